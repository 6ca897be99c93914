"""The site that `make docs` makes of the documents: Sphinx, docs/adr/0020-site.md. Its own directives are in docs/site_directives.py."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "docs"), str(ROOT / "python")]

project = "trihedron"
version = release = re.search(r"project\(trihedron VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
copyright = "the authors of trihedron"
language = "en"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_copybutton", "site_directives"]
exclude_patterns = ["requirements.txt"]
nitpicky = True
# Types of other packages, of which no inventory is at hand, and our own names for unions of types.
nitpick_ignore_regex = [("py:.*", r"(?!trihedron\.[a-z_]+$).*")]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4

html_theme = "furo"
html_title = f"trihedron {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
pygments_style = "friendly"
pygments_dark_style = "monokai"
# A command is copied without its prompt, and nothing of what it printed.
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
copybutton_line_continuation_character = "\\"

# Of the package the part in Python is read; the part in C++ need not be compiled for that.
autodoc_mock_imports = ["trihedron._native", "h5netcdf", "h5py", "tomli_w"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"npt.ArrayLike": "ArrayLike", "PathLike": "PathLike", "Progress": "Progress", "Doubles": "Doubles"}
python_use_unqualified_type_names = True
add_module_names = False
default_role = "code"


def arguments_are_a_list(_app, _what, _name, _object, _options, lines):
    """Lines of a docstring that begin with the name of an argument, "seed: …", as a list."""
    inside = False
    for index, line in enumerate(lines):
        begins = re.match(r"([a-z_]+(?:, [a-z_]+)*): (.*)", line)
        if begins:
            lines[index] = f"- **{begins[1]}**: {begins[2]}"
            if not inside:
                lines[index] = "\n" + lines[index]
        inside = bool(begins) or (inside and line.strip() != "")
        if inside and not begins:
            lines[index] = "  " + line
    lines[:] = "\n".join(lines).split("\n")


def names_of_types_are_short(_app, _what, _name, _object, _options, signature, returns):
    return tuple(its and re.sub(r"TypeAliasForwardRef\('(\w+)'\)|trihedron\._native\.(\w+)", r"\1\2", its) for its in (signature, returns))


def setup(app):
    app.connect("autodoc-process-signature", names_of_types_are_short)
    app.connect("autodoc-process-docstring", arguments_are_a_list)
