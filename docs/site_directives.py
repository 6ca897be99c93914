"""What the site has beyond Markdown, for docs/conf.py: links from paths in the text, keys of files by their schemas, and drawings of what the
commands of a page have written."""
import functools
import json
import os
import pathlib
import re
import subprocess
import zlib
import xml.etree.ElementTree

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.util.docutils import SphinxDirective

import figures
import shown

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ.get("TRIHEDRON_BUILD", ROOT / "build"))
PROGRAM = BUILD / "trihedron"
CPP = ROOT / "out" / "docs" / "cpp"


@functools.cache
def cpp_pages():
    """Page of each header in what Doxygen made of them, by its path in the repository."""
    compounds = xml.etree.ElementTree.parse(CPP / "trihedron.tag").getroot().iter("compound")
    files = [its for its in compounds if its.get("kind") == "file"]
    paths = {its.findtext("path") + its.findtext("name"): its.findtext("filename").removesuffix(".html") + ".html" for its in files}
    return {path.removeprefix(f"{ROOT}/"): page for path, page in paths.items()}


class PathsAreLinks(SphinxTransform):
    """`docs/formats.md` in a text is a link with the title of that page, `core/include/trihedron.h` leads to the reference of that header. And a
    block that begins with >>> is coloured as Python."""

    default_priority = 400
    pages = {"README.md": "index", "CONTRIBUTING.md": "explanation/contributing", "CHANGELOG.md": "reference/changelog",
             "docs/adr/": "explanation/decisions"}

    def apply(self, **_):
        for block in self.document.findall(nodes.literal_block):
            if block.astext().startswith(">>> "):
                block["language"] = "pycon"
        for literal in list(self.document.findall(nodes.literal)):
            path = literal.astext()
            if isinstance(literal.parent, (nodes.reference, addnodes.pending_xref, nodes.title)):
                continue
            page = re.fullmatch(r"docs/(\S+)\.md", path)
            page = self.pages.get(path) or (page and page[1])
            if page and page != self.env.docname:
                link = addnodes.pending_xref("", refdomain="std", reftype="doc", reftarget=f"/{page}", refexplicit=False, refwarn=True,
                                             refdoc=self.env.docname)
            elif path in cpp_pages():
                link = nodes.reference("", "", refuri="../" * self.env.docname.count("/") + "cpp/" + cpp_pages()[path], internal=False)
            else:
                continue
            literal.replace_self(link)
            link += literal


def value_of(schema):
    """What a key may hold, in words."""
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(value_of(choice) for choice in schema["anyOf"]))
    if "enum" in schema:
        return ", ".join(f"`{word}`" for word in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    kinds = schema.get("type", "anything")
    kinds = kinds if isinstance(kinds, list) else [kinds]
    return " or ".join(value_of_kind(kind, schema) for kind in kinds)


def value_of_kind(kind, schema):
    if kind == "array":
        items = value_of(schema.get("items", {}))
        count = schema.get("minItems") if schema.get("minItems") == schema.get("maxItems") else None
        return f"{count} values, each {items}" if count else f"list, each {items}"
    if kind == "string":
        examples = schema.get("examples")
        return f"text like `\"{examples[0]}\"`" if examples else "text"
    if kind in ("number", "integer"):
        name = "whole number" if kind == "integer" else "number"
        least, most = schema.get("minimum"), schema.get("maximum")
        if least is not None and most is not None:
            return f"{name}, {least:g} … {most:g}"
        return name + (f", from {least:g} on" if least is not None else f", up to {most:g}" if most is not None else "")
    return {"boolean": "`true` or `false`", "null": "`null`", "object": "table"}.get(kind, kind)


def object_in(schema):
    """The schema of the table, or of each table, that a key holds, and how it is written; None of another value."""
    for choice in schema.get("anyOf", [schema]):
        kinds = choice.get("type", [])
        if "object" in kinds and ("properties" in choice or isinstance(choice.get("additionalProperties"), dict)):
            return choice, False
        if "array" in kinds and "object" in choice.get("items", {}).get("type", []):
            return choice["items"], True
    return None, False


def tables_of(schema, path=(), is_toml=True, many=False):
    """Lines of Markdown: a table of the keys of each table."""
    name = ".".join(path)
    lines = [f"### `[[{name}]]`" if many and is_toml else f"### `[{name}]`" if is_toml else f"### `{name}`", ""] if path else []
    rows, inner = [], []
    keys = dict(schema.get("properties", {}))
    more = schema.get("additionalProperties")
    if isinstance(more, dict):
        keys["NAME"] = more
    for key, its in keys.items():
        about = its.get("description", "") + ("; required" if key in schema.get("required", []) and is_toml else "")
        table, each = object_in(its)
        if table is not None:
            inner += tables_of(table, (*path, key), is_toml, each)
            if "anyOf" not in its:
                if its.get("description"):
                    rows.append((key, "tables" if each else "table", about))
                continue
        rows.append((key, value_of(its), about))
    if rows:
        cells = [(f"`{key}`", value, about) for key, value, about in rows]
        lines += ["| key | value | what it is |", "|---|---|---|"]
        lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells] + [""]
    return lines + inner


class Keys(SphinxDirective):
    """Keys of a file, or members of an output, by `trihedron schema NAME`: a table for each of its objects."""

    required_arguments = 1

    def run(self):
        name = self.arguments[0]
        self.env.note_dependency(str(PROGRAM))
        text = subprocess.run([PROGRAM, "schema", name], capture_output=True, check=True, text=True).stdout
        is_toml = name in ("pass", "telemetry", "config", "scenario", "campaign")
        return self.parse_text_to_nodes("\n".join(tables_of(json.loads(text), is_toml=is_toml)), allow_section_headings=True)


LITERALS = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'


def in_one(literals):
    """The text of C++ literals that stand one after another."""
    return "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', literals))


def records_of(source):
    """{class: (text, {member: text})} of what nanobind is told in a source."""
    result = {}
    for part in source.split("nb::class_<")[1:]:
        name = re.match(r'[^(]*\(module, "(\w+)",\s*' + LITERALS, part)
        members = {}
        for definition in part[name.end():].split(".def_")[1:] if name else []:
            member = re.match(r'(?:ro|prop_ro)\(\s*"(\w+)"', definition)
            if member:
                told = re.findall(r",\s*" + LITERALS + r"\)", re.split(r"\n\s*\.def\(|;\n\s*\n|;\n  (?:nb::|\w)", definition[member.end():])[0])
                members[member[1]] = in_one(told[-1]) if told else ""
        if name:
            result[name[1]] = (in_one(name[2]), members)
    return result


class Records(SphinxDirective):
    """Records that the part of the Python package in C++ gives, each with its members, by their texts in its sources."""

    has_content = True

    def run(self):
        records = records_of("".join(path.read_text() for path in sorted((ROOT / "python" / "src").glob("*.cpp"))))
        lines = []
        for name in self.content:
            text, members = records[name]
            lines += [f":::{{py:class}} {name}", ":module: trihedron._native", "", f"{text}.", "", "| member | what it is |", "|---|---|",
                      *(f"| `{key}` | {told} |" for key, told in members.items()), ":::", ""]
        return self.parse_text_to_nodes("\n".join(lines))


@functools.cache
def work_of(page):
    """The directory in which the commands of a page were run."""
    work = ROOT / "build-docs" / "work" / page.relative_to(ROOT / "docs").with_suffix("")
    text = page.read_text()
    done = work / "done"
    if not done.exists() or done.read_text() != text or done.stat().st_mtime < PROGRAM.stat().st_mtime:
        subprocess.run(["rm", "-rf", work], check=True)
        shown.run(text, BUILD, work)
        done.write_text(text)
    return work


class Drawn(SphinxDirective):
    """A figure by the function of docs/figures.py that has this name, of what the commands of the page wrote. The content is its caption."""

    required_arguments = 1
    option_spec = {"alt": directives.unchanged_required}
    has_content = True

    def run(self):
        page = pathlib.Path(self.env.doc2path(self.env.docname))
        figure = nodes.figure()
        figure += nodes.raw("", figures.drawn(self.arguments[0], work_of(page), self.options["alt"]), format="html")
        if self.content:
            caption = nodes.caption()
            caption += self.parse_inline("\n".join(self.content))[0]
            figure += caption
        self.env.note_dependency(str(PROGRAM))
        self.env.note_dependency(str(ROOT / "docs" / "figures.py"))
        return [figure]


def setup(app):
    app.add_transform(PathsAreLinks)
    app.add_directive("keys", Keys)
    app.add_directive("records", Records)
    app.add_directive("drawn", Drawn)
    # Pages are read again where this file is another one.
    return {"parallel_read_safe": True, "env_version": zlib.crc32(pathlib.Path(__file__).read_bytes())}
