"""Figures of the site, drawn of what the commands of a page have written: each function takes the directory in which they were run.

They stand in the page as SVG with text, and take its colours and fonts, in light and in dark.
"""
import html
import io
import json
import re

import matplotlib
import numpy as np
from matplotlib.figure import Figure

INK = "#010203"  # stands for the colour of the text around the figure
BLUE, ORANGE, GREEN = "#3b82c4", "#d97728", "#3d9a6a"
ARCSECOND = np.pi / 180 / 3600

matplotlib.rcParams.update({
    "svg.fonttype": "none", "font.size": 10, "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": INK, "xtick.color": INK, "ytick.color": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": INK, "grid.alpha": 0.15, "grid.linewidth": 0.6,
    "legend.frameon": False, "lines.linewidth": 1.6})


def drawn(name, work, alt):
    """The figure as SVG within HTML."""
    matplotlib.rcParams["svg.hashsalt"] = f"{name} {alt}"  # names within are unique in a page
    buffer = io.StringIO()
    globals()[name](work).savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg"):].replace(INK, "currentColor")
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)
    return re.sub(r"<svg[^>]*>", f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 {size[1]} {size[2]}" '
                  f'role="img" aria-label="{html.escape(alt, quote=True)}">', svg, count=1)


def axes(height=2.9):
    figure = Figure(figsize=(5.6, height), layout="constrained")
    return figure, figure.subplots()


def table(path, *columns):
    """Columns of a CSV file by their names."""
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=[names.index(its) for its in columns], unpack=True)


def error_arcsec(path, truth, begin_s=0):
    """(time, angle between an attitude file and the truth) where both have a row; time 0 of the file is this one of the truth."""
    t_s, *q = table(path, "t_s", "q_x", "q_y", "q_z", "q_w")
    true_t_s, *q_true = table(truth, "t_s", "q_x", "q_y", "q_z", "q_w")
    _, rows, true_rows = np.intersect1d(np.round(t_s + begin_s, 3), np.round(true_t_s, 3), return_indices=True)
    x, y, z, w = (its[rows] for its in q)
    a, b, c, d = (its[true_rows] for its in q_true)
    # The vector part of q_true* ⊗ q is the sine of half the angle.
    vector = np.array([d * x - a * w - b * z + c * y, d * y + a * z - b * w - c * x, d * z - a * y + b * x - c * w])
    return t_s[rows], 2 * np.arcsin(np.clip(np.linalg.norm(vector, axis=0), 0, 1)) / ARCSECOND


def per_minute(t_s, values):
    """(minutes, root mean square) of each minute."""
    minute = np.floor(t_s / 60)
    minutes, index = np.unique(minute, return_inverse=True)
    return minutes + 0.5, np.sqrt(np.bincount(index, values**2) / np.bincount(index))


def minutes_axis(ax, label="minutes after the first fix"):
    ax.set_xlabel(label)
    ax.set_yscale("log")
    ax.set_ylabel("attitude error")
    ticks = {0.1: "0.1″", 1: "1″", 10: "10″", 60: "1′", 300: "5′", 1800: "30′"}
    ax.set_yticks(list(ticks), list(ticks.values()))
    ax.minorticks_off()


def errors(ax, work, truth, files):
    """Error of each file, (name, label, colour), by the minute."""
    for name, label, colour in files:
        ax.plot(*per_minute(*error_arcsec(work / name, truth)), color=colour, label=label)
    minutes_axis(ax)


def before_and_after(work):
    figure, ax = axes()
    errors(ax, work, work / "pass/truth.csv", [("before.csv", "as known before", ORANGE), ("after.csv", "calibrated", BLUE)])
    ax.legend(loc="lower right")
    return figure


def wednesday(work):
    figure, ax = axes()
    begin_s = 160 * 60
    for name, label, colour in (("before.csv", "as known before", ORANGE), ("attitude.csv", "calibrated on Monday and Tuesday", BLUE)):
        ax.plot(*per_minute(*error_arcsec(work / name, work / "flight/truth.csv", begin_s)), color=colour, label=label)
    minutes_axis(ax)
    ax.axhline(40, color=INK, linestyle="--", linewidth=1)
    ax.legend(loc="lower right")
    return figure


def weak_axis(work):
    figure, ax = axes()
    for name, label, colour in (("steady.json", "steady", ORANGE), ("slewing.json", "with one slew", BLUE)):
        found = json.loads((work / name).read_text())
        sigma = next(its["sigma_until"] for its in found["parameters"] if its["name"] == "gyro1.align_y")
        ax.plot(np.array(found["t_s"]) / 60, np.array(sigma) / ARCSECOND, color=colour, label=label)
    minutes_axis(ax, "minutes of the flight")
    ax.set_ylabel("1σ of the alignment")
    ax.legend(loc="lower left")
    return figure


def adoption(work):
    figure, ax = axes()
    errors(ax, work, work / "pass/truth.csv", [("attitude.csv", "attitude by the application", BLUE)])
    adopted = re.search(r"([\d.]+) min  calibration adopted", (work / "replay.txt").read_text())
    ax.axvline(float(adopted[1]), color=INK, linestyle="--", linewidth=1)
    return figure


def forecast(work):
    figure, ax = axes()
    told = json.loads((work / "good/calibration.json").read_text())["forecast"]
    hours = np.array(told["after_s"]) / 3600
    for key, label, colour in (("error_997_rad", "99.7 %", ORANGE), ("error_95_rad", "95 %", GREEN), ("error_68_rad", "68 %", BLUE)):
        ax.plot(hours, np.array(told[key]) / ARCSECOND, color=colour, label=f"not exceeded in {label}")
    ax.set_xlabel("hours after a correction")
    ax.set_ylabel("attitude error, ″")
    ax.set_ylim(bottom=0)
    ax.legend(loc="upper left")
    return figure
