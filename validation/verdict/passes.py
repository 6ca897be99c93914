"""Passes as directories of CSV files: cutting one in two, and making its telemetry wrong."""
import pathlib


class Telemetry:
    """The telemetry of a pass, to be edited. Rows are lists of numbers, t_s first."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)

    def rewrite(self, name, edit):
        """edit(rows) returns the rows to write."""
        file = self.directory / name
        head, *lines = file.read_text().splitlines()
        rows = edit([[float(cell) for cell in line.split(",")] for line in lines])
        file.write_text("\n".join([head] + [",".join([f"{row[0]:.9f}"] + [f"{cell:.12g}" for cell in row[1:]]) for row in rows]) + "\n")

    def fixes(self, edit):
        """edit(t_s, q) returns the q to write."""
        self.rewrite("star_tracker.csv", lambda rows: [[row[0], *edit(row[0], tuple(row[1:5]))] for row in rows])

    def readings(self, edit):
        """edit(t_s, cosines of all gyros) returns those to write."""
        self.rewrite("gyro.csv", lambda rows: [[row[0], *edit(row[0], row[1:])] for row in rows])

    def settings(self, *replacements):
        """Of (old, new) in pass.toml."""
        file = self.directory / "pass.toml"
        text = file.read_text()
        for old, new in replacements:
            if old not in text:
                raise ValueError(f"{file} does not contain: {old}")
            text = text.replace(old, new)
        file.write_text(text)


def row_at(data, t_s):
    """Where the first row with a time of at least t_s begins, in the bytes of a CSV file whose times increase."""
    low, high = data.index(b"\n") + 1, len(data)
    while low < high:
        middle = data.rfind(b"\n", 0, (low + high) // 2) + 1
        if middle <= low:
            end = data.index(b"\n", low) + 1
            if float(data[low:data.index(b",", low)]) >= t_s:
                return low
            low = end
        elif float(data[middle:data.index(b",", middle)]) >= t_s:
            high = middle
        else:
            low = data.index(b"\n", middle) + 1
    return low


def cut(whole, first, second, at_s):
    """The telemetry of the directory `whole` until at_s, and that from there on, times unchanged, into directories of their own."""
    for directory in (first, second):
        directory.mkdir()
        (directory / "pass.toml").write_text((whole / "pass.toml").read_text())
    for file in whole.glob("*.csv"):
        if file.name.startswith("truth"):
            continue
        data = file.read_bytes()
        place = row_at(data, at_s)
        head = data[:data.index(b"\n") + 1]
        (first / file.name).write_bytes(data[:place])
        (second / file.name).write_bytes(head + data[place:])
