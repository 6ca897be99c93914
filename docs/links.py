#!/usr/bin/env python3
"""Whether each link of a site leads to a page and a place in it that are there: links.py DIRECTORY. Links to the network are not followed."""
import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    """Links of a page, and the names that links can lead to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.names = set(), set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.add(value)
            elif name == "id" or (name == "name" and tag == "a"):
                self.names.add(value)


def broken_links(directory):
    """(page, link) of each that leads nowhere."""
    pages = {path.resolve(): Page(path) for path in directory.glob("**/*.html")}
    result = []
    for path, page in pages.items():
        for link in sorted(page.links):
            its = urllib.parse.urlsplit(link)
            if its.scheme or its.netloc or link == "#nested-classes":  # Doxygen 1.9.4 leaves that heading out where a class has private ones alone
                continue
            target = (path.parent / urllib.parse.unquote(its.path)).resolve() if its.path else path
            fragment = urllib.parse.unquote(its.fragment)
            if not target.exists() or (fragment and target in pages and fragment not in pages[target].names):
                result.append((path.relative_to(directory.resolve()), link))
    return result


if __name__ == "__main__":
    broken = broken_links(pathlib.Path(sys.argv[1]))
    for its in broken:
        print(*its, sep=": ", file=sys.stderr)
    sys.exit(1 if broken else 0)
