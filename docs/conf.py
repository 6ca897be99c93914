"""The site that `make docs` makes of the documents: Sphinx, docs/adr/0019-site.md. Its own directives are in docs/site_directives.py."""
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
autodoc_class_signature = "separated"
python_use_unqualified_type_names = True
