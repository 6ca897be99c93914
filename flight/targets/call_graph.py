"""Who calls whom in compiled code, and with how much stack, by what g++ writes with -fcallgraph-info=su.

So far as the graph is whole, the deepest chain of calls bounds the stack; that it has no circle proves that nothing is recursive.
"""
import functools
import re

NODE = re.compile(r'^node: \{ title: "([^"]*)" label: "([^"]*)"')
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"')
def symbol(title):
    """One name for a function in all files: g++ puts the name of the file before those that may be in several, of which the linker
    keeps one, but for those that are another in each file; and a complete constructor is the same as one of a base."""
    name = title.rsplit(":", 1)[-1]
    if "_GLOBAL__N_" in name or "." in name:
        return title
    return re.sub(r"C1E", "C2E", re.sub(r"D1Ev", "D2Ev", name))


FRAME = re.compile(r"\\n(\d+) bytes \(([a-z,]+)\)")


class CallGraph:
    def __init__(self, files):
        self.frames = {}  # bytes of each function that is compiled here
        self.names = {}
        self.unbounded = set()  # functions whose frame depends on their arguments
        self.calls = {}
        for file in files:
            for line in file.read_text().splitlines():
                if node := NODE.match(line):
                    title, label = symbol(node[1]), node[2]
                    if frame := FRAME.search(label):
                        self.frames[title] = max(int(frame[1]), self.frames.get(title, 0))
                        self.names[title] = label.split("\\n")[0]
                        if frame[2] == "dynamic":
                            self.unbounded.add(title)
                elif edge := EDGE.match(line):
                    self.calls.setdefault(symbol(edge[1]), set()).add(symbol(edge[2]))

    def find(self, pattern):
        """The functions whose declaration matches."""
        return sorted(title for title, name in self.names.items() if re.search(pattern, name))

    def reached(self, roots):
        found, left = set(), list(roots)
        while left:
            title = left.pop()
            if title not in found:
                found.add(title)
                left.extend(self.calls.get(title, ()))
        return found

    def foreign(self, roots):
        """Functions of other libraries that are called."""
        return sorted(title for title in self.reached(roots) if title not in self.frames)

    def circle(self, roots):
        """Functions that call each other in a circle, or nothing."""
        done = set()

        def search(title, path):
            if title in path:
                return path[path.index(title):]
            if title in done:
                return []
            for callee in self.calls.get(title, ()):
                if found := search(callee, path + [title]):
                    return found
            done.add(title)
            return []

        for root in roots:
            if found := search(root, []):
                return found
        return []

    def deepest(self, root):
        """Bytes of stack of the deepest chain of calls from `root`, and the chain. Needs that there is no circle."""

        @functools.cache
        def depth(title):
            below, chain = max((depth(callee) for callee in self.calls.get(title, ())), default=(0, ()))
            return below + self.frames.get(title, 0), (title,) + chain

        return depth(root)
