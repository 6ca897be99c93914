"""The worlds of the verdict: what each pass is made of. World.name is what --worlds selects by, World.group the part of the table.

A world gives the scenario of the pass, by a random generator of its seed, and may edit the telemetry afterwards. Drift outside the models is
given in a size that is a few percent of eq. (1), 2e-6 rad/s, and in one that is about half of it.
"""
import dataclasses
import math
import random
from collections.abc import Callable

from rotations import exponential, inverse, product, rotated

ARCSECOND = math.pi / 180 / 3600
PASS_S = 9 * 3600.0
ORBITAL_RATE_RAD_S = 1.11e-3


@dataclasses.dataclass(frozen=True)
class World:
    name: str
    group: str
    scenario: Callable[[random.Random], str]  # the TOML text behind [scenario], without its seed and duration
    # (telemetry, random): of the pass that is calibrated and, with the same draws, of that which is forecast; returns what moved, or None.
    edit: Callable | None = None
    faults: tuple = ()  # findings that say what is true of this world, and may forbid the use of a result that is right


@dataclasses.dataclass(frozen=True)
class Moved:
    """What stands elsewhere at the end of the pass than the truth of the simulation says: quaternions."""
    gyro: tuple | None = None     # of the case of gyro 1: h_b = gyro h_b(simulated)
    exchanged: bool = False       # gyros of one mounting with their columns exchanged: each is then called by the name of the other
    tracker: tuple | None = None  # of c, which are the axes of the star tracker: q_in_c = q_in_c(simulated) tracker


def toml(**tables):
    """"gyro_drift" is [gyro.drift]; values are written as they are, texts quoted by the caller."""
    return "".join(f"[{name.replace('_drift', '.drift').replace('_readout', '.readout')}]\n"
                   + "".join(f"{key} = {value}\n" for key, value in table.items()) for name, table in tables.items())


QUIET = {"outside_sigma": '"0rad/s"'}


def constant(text):
    return lambda random: text


# ---- Worlds of nothing but what the models contain

SLEWS = toml(gyro_drift={})
NO_OUTSIDE = toml(gyro_drift=QUIET)
STEADY = toml(attitude={"slews": '"none"'}, gyro_drift={})
YAW_STEERED = toml(attitude={"reference": '"yaw-steered"', "slews": '"none"'}, gyro_drift={})
YAW_STEERED_SLEWS = toml(attitude={"reference": '"yaw-steered"'}, gyro_drift={})
THREE_GYROS = toml(gyro_drift={}) + "".join(f"[[gyro.unit]]\nstart_direction_c = {direction}\n" for direction in (
    "[0.995, 0.087, 0.045]", "[0.14, 0.985, 0.094]", "[0.1, 0.2, 0.97]"))


# ---- Drift that no model contains

def per_gyro(random, drift_of):
    """drift_of(random, gyro): lines of [gyro.unit.drift]."""
    directions = ("[0.995, 0.087, 0.045]", "[0.14, 0.985, 0.094]")
    return toml(gyro_drift=QUIET) + "".join(
        f"[[gyro.unit]]\nstart_direction_c = {direction}\n[gyro.unit.drift]\n{drift_of(random, gyro)}\n" for gyro, direction in enumerate(directions))


def members(random, amplitude, degrees=(1, 3, 4, 6)):
    """All members of these degrees, each within ± amplitude."""
    drawn = [f'{{potential = "{potential}", degree = {degree}, order = {order}, amplitude = "{random.uniform(-amplitude, amplitude):.6e}rad/s"}}'
             for potential in "WD" for degree in degrees for order in range(-degree, degree + 1)]
    return f"harmonics = [{', '.join(drawn)}]"


def degrees(amplitude):
    return lambda random: per_gyro(random, lambda random, gyro: members(random, amplitude))


def bump(amplitude):
    """On the way of each momentum: that of gyro 1 goes round in the plane of x and z, that of gyro 2 stays within 40 degrees of y."""
    def centre(random, gyro):
        angle, side = random.uniform(0, 2 * math.pi), random.uniform(-0.3, 0.3)
        return (math.cos(angle), side, math.sin(angle)) if gyro == 0 else (0.3 * math.cos(angle), 1, 0.3 * math.sin(angle))
    return lambda random: per_gyro(random, lambda random, gyro: f'bump = "{amplitude}rad/s"\nbump_centre = {list(centre(random, gyro))}')


def polhodes_apart(fraction):
    """Each rotor with a polhode of its own, whose period grows or shrinks."""
    return lambda random: per_gyro(random, lambda random, gyro: "\n".join((
        f"polhode_fraction = {fraction}", f'polhode_period = "{random.uniform(70, 240):.1f}min"',
        f"polhode_period_rate = {random.uniform(-0.02, 0.02):.4f}")))


def drifting(**keys):
    return constant(toml(gyro_drift=QUIET | keys))


# ---- Telemetry that is dirty as telemetry is

DIRTY = toml(gyro={"gaps": '[{begin = "100min", end = "112min"}, {begin = "301min", end = "301.5min"}]'}, gyro_drift={},
             gyro_readout={"dropout_probability": 0.001, "spike_probability": 0.001, "stuck_probability": 1e-5},
             star_tracker={"outlier_probability": 0.02, "dropout_probability": 0.02, "wrong_sign_probability": 0.5,
                           "outages": '[{begin = "200min", end = "230min"}]'})


def tracker(**keys):
    return constant(toml(gyro_drift={}, star_tracker=keys))


# ---- Telemetry that is wrong

def in_degrees(telemetry, random):
    """Direction cosines given as angles from 90 degrees would be caught by their norm; the noise of pass.toml is what is read."""
    def scale(text):
        return f"{float(text) * 180 / math.pi!r}"
    lines = (telemetry.directory / "pass.toml").read_text().splitlines()
    for line in lines:
        if line.startswith("noise_rad"):
            values = line[line.index("[") + 1:line.index("]")].split(",")
            telemetry.settings((line, f"noise_rad = [{', '.join(scale(value) for value in values)}]"))
        elif line.startswith("readout_noise_rad"):
            telemetry.settings((line, f"readout_noise_rad = {scale(line.split('=')[1].split('#')[0])}"))


def fixes_by(change):
    return lambda telemetry, random: telemetry.fixes(lambda t_s, q: change(q))


def readings_by(change):
    return lambda telemetry, random: telemetry.readings(lambda t_s, h: change(h))


def cubic(factor):
    """Each cosine off by its cube times a factor, in a reading that is a unit vector."""
    def off(h):
        longer = [x + factor * x ** 3 for x in h]
        return [x / math.hypot(*longer) for x in longer]
    return readings_by(lambda h: [c for k in range(0, len(h), 3) for c in off(h[k:k + 3])])


def harmonic(amplitude_rad, turns):
    """Off about the axis y of a case by a sine of the angle about it, so many times a turn."""
    def off(h):
        angle = amplitude_rad * math.sin(turns * math.atan2(h[2], h[0]) + 0.5)
        return rotated(exponential([0, angle, 0]), h)
    return readings_by(lambda h: [c for k in range(0, len(h), 3) for c in off(h[k:k + 3])])


def exchanged(telemetry, random):
    """No telemetry can tell: where both are mounted alike, only their names are wrong."""
    telemetry.readings(lambda t_s, h: h[3:] + h[:3])
    return Moved(exchanged=True)


def stamps_of_fixes(change):
    """change(t_s) returns the stamp that is written."""
    return lambda telemetry, random: telemetry.rewrite("star_tracker.csv", lambda rows: [[change(row[0]), *row[1:]] for row in rows])


def attitudes(telemetry):
    """Those of the fixes: (t_s, quaternion)."""
    for line in (telemetry.directory / "star_tracker.csv").read_text().splitlines()[1:]:
        cells = [float(cell) for cell in line.split(",")]
        yield cells[0], tuple(cells[1:5])


def drifts_at_orbital_period(sigma_rad_s):
    """Each momentum by a drift of sine and cosine about each body axis, as of a temperature or the Earth's magnetic field."""
    rate_rad_s = ORBITAL_RATE_RAD_S
    def edit(telemetry, random):
        amplitudes = [[[random.gauss(0, sigma_rad_s) for _ in range(3)] for _ in range(2)] for gyro in range(2)]
        turned, last_s = [[0.0] * 3, [0.0] * 3], None
        turns = []  # t_s; of each gyro in body axes, as a quaternion
        for t_s, q in attitudes(telemetry):
            phase = rate_rad_s * t_s
            for gyro, (sine, cosine) in enumerate(amplitudes):
                rate = [math.sin(phase) * s + math.cos(phase) * c for s, c in zip(sine, cosine)]
                step_s = 0 if last_s is None else t_s - last_s
                moved = rotated(q, scaled(rate, step_s))
                turned[gyro] = [a + b for a, b in zip(turned[gyro], moved)]
            last_s = t_s
            turns.append((t_s, [exponential(rotated(inverse(q), turn)) for turn in turned]))
        at = 0
        def change(t_s, h):
            nonlocal at
            while at + 1 < len(turns) and turns[at + 1][0] <= t_s:
                at += 1
            return [x for gyro, turn in enumerate(turns[at][1]) for x in rotated(turn, h[3 * gyro:3 * gyro + 3])]
        telemetry.readings(change)
    return edit


def readout_noise_told(factor):
    def edit(telemetry, random):
        for line in (telemetry.directory / "pass.toml").read_text().splitlines():
            if line.startswith("readout_noise_rad"):
                telemetry.settings((line, f"readout_noise_rad = {float(line.split('=')[1].split('#')[0]) * factor!r}"))
    return edit


def tracker_noise_grows(factor, noise_rad):
    """From mid-pass on."""
    def edit(telemetry, random):
        more = math.sqrt(factor * factor - 1)
        def change(t_s, q):
            error = tuple(random.gauss(0, more * sigma) for sigma in noise_rad)
            return product(q, exponential(error)) if t_s >= PASS_S / 2 else q
        telemetry.fixes(change)
    return edit


def tracker_moves(rotation_vector_of):
    """A fix is C_in_c exp([e×]), e = rotation_vector_of(t_s, random axis)."""
    def edit(telemetry, random):
        axis = unit(random)
        # What moves stops at the end of the pass, so that afterwards there is one truth.
        telemetry.fixes(lambda t_s, q: product(q, exponential(rotation_vector_of(min(t_s, PASS_S), axis))))
        return Moved(tracker=exponential(rotation_vector_of(PASS_S, axis)))
    return edit


def tracker_off_at_times(part, size_rad):
    """This part of the fixes, drawn one by one, is off about one axis across the boresight."""
    def edit(telemetry, random):
        angle = random.uniform(0, 2 * math.pi)
        off = exponential((size_rad * math.cos(angle), size_rad * math.sin(angle), 0))
        telemetry.fixes(lambda t_s, q: product(q, off) if random.random() < part else q)
    return edit


def tracker_wanders(sigma_rad, time_s):
    """A fix is C_in_c exp([e×]), each component of e a Gauss–Markov process."""
    def edit(telemetry, random):
        def moved(rows):
            e, last_s = [random.gauss(0, sigma_rad) for _ in range(3)], rows[0][0]
            for row in rows:
                kept = math.exp(-(row[0] - last_s) / time_s)
                e = [kept * x + random.gauss(0, sigma_rad * math.sqrt(1 - kept * kept)) for x in e]
                last_s = row[0]
                row[1:5] = product(tuple(row[1:5]), exponential(tuple(e)))
            return rows
        telemetry.rewrite("star_tracker.csv", moved)
    return edit


def unit(random):
    v = [random.gauss(0, 1) for _ in range(3)]
    size = math.sqrt(sum(x * x for x in v))
    return [x / size for x in v]


def scaled(axis, size):
    return [size * x for x in axis]


def frozen(seconds):
    def edit(telemetry, random):
        begin = random.uniform(0.2, 0.7) * PASS_S
        def held(rows):
            last = None
            for row in rows:
                if begin <= row[0] < begin + seconds and last is not None:
                    row[1:] = last
                last = row[1:]
            return rows
        telemetry.rewrite("star_tracker.csv", held)
    return edit


def case_steps(size_rad):
    """The case of gyro 1 turns against c in mid-pass: its readings do."""
    def edit(telemetry, random):
        turn = exponential(scaled(unit(random), size_rad))
        def change(t_s, h):
            return [*product(product(turn, (*h[:3], 0.0)), inverse(turn))[:3], *h[3:]] if t_s >= PASS_S / 2 else h
        telemetry.readings(change)
        return Moved(gyro=turn)
    return edit


def spikes(share, size_rad):
    """Of gyro 1, that keep the norm."""
    def edit(telemetry, random):
        def change(t_s, h):
            if random.random() >= share:
                return h
            turn = exponential(scaled(unit(random), random.uniform(0, size_rad)))
            return [*product(product(turn, (*h[:3], 0.0)), inverse(turn))[:3], *h[3:]]
        telemetry.readings(change)
    return edit


def late(seconds):
    """Gyro 2 is stamped late: its column is moved by whole samples."""
    def edit(telemetry, random):
        def shifted(rows):
            samples = round(seconds / 0.125)
            columns = [row[4:7] for row in rows]
            return [[*row[:4], *columns[max(i - samples, 0)]] for i, row in enumerate(rows)]
        telemetry.rewrite("gyro.csv", shifted)
    return edit


def inertial_step(size_rad):
    """From mid-pass on the momentum of gyro 1 is another one: turned in inertial space, at the attitude of the nearest fix."""
    def edit(telemetry, random):
        fixes = {round(t_s / 3): q for t_s, q in attitudes(telemetry)}
        turn = exponential(scaled(unit(random), size_rad))
        def change(t_s, h):
            if t_s < PASS_S / 2:
                return h
            q = fixes.get(round(t_s / 3))
            both = product(product(inverse(q), turn), q) if q else turn
            return [*product(product(both, (*h[:3], 0.0)), inverse(both))[:3], *h[3:]]
        telemetry.readings(change)
    return edit


NOT_CONSTANT = ("coefficients-not-constant",)

WORLDS = [
    World("slews", "in the models", constant(SLEWS)),
    World("slews-eq1", "in the models", constant(NO_OUTSIDE)),
    World("steady", "in the models", constant(STEADY), faults=("weak-alignment-axis",)),
    World("yaw-steered", "in the models", constant(YAW_STEERED)),
    World("yaw-steered-slews", "in the models", constant(YAW_STEERED_SLEWS)),
    World("three-gyros", "in the models", constant(THREE_GYROS)),

    World("degrees-5e-8", "drift outside eq. (1)", degrees(5e-8)),
    World("degrees-8e-8", "drift outside eq. (1)", degrees(8e-8)),
    World("degrees-2e-8-yaw-steered", "drift outside eq. (1)", lambda random: degrees(2e-8)(random) + toml(attitude={"reference": '"yaw-steered"', "slews": '"none"'})),
    World("bump-5e-8", "drift outside eq. (1)", bump(5e-8)),
    World("bump-1e-6", "drift outside eq. (1)", bump(1e-6)),
    World("hysteresis-5e-7", "drift outside eq. (1)", drifting(hysteresis='"5e-7rad/s"')),
    World("hysteresis-5e-8", "drift outside eq. (1)", drifting(hysteresis='"5e-8rad/s"')),
    World("after-slews-0.5", "drift outside eq. (1)", drifting(slew_fraction=0.5), faults=NOT_CONSTANT),
    World("after-slews-0.05", "drift outside eq. (1)", drifting(slew_fraction=0.05), faults=NOT_CONSTANT),
    World("jump-1e-6", "drift outside eq. (1)", drifting(jump_sigma='"1e-6rad/s"'), faults=NOT_CONSTANT),
    World("jump-1e-7", "drift outside eq. (1)", drifting(jump_sigma='"1e-7rad/s"'), faults=NOT_CONSTANT),
    World("polhode-0.5", "drift outside eq. (1)", drifting(polhode_fraction=0.5), faults=NOT_CONSTANT),
    World("polhode-0.05", "drift outside eq. (1)", drifting(polhode_fraction=0.05), faults=NOT_CONSTANT),
    World("polhodes-apart-0.2", "drift outside eq. (1)", polhodes_apart(0.2), faults=NOT_CONSTANT),
    World("thermal-0.5", "drift outside eq. (1)", drifting(thermal_fraction=0.5), faults=NOT_CONSTANT),
    World("thermal-0.05", "drift outside eq. (1)", drifting(thermal_fraction=0.05), faults=NOT_CONSTANT),
    World("walk", "drift outside eq. (1)", drifting(coefficient_walk='"1e-10rad/s/s^0.5"'), faults=NOT_CONSTANT),
    World("wander-20min", "drift outside eq. (1)", drifting(markov_sigma='"5e-8rad/s"', markov_time='"20min"')),
    World("wander-3h", "drift outside eq. (1)", drifting(markov_sigma='"3e-8rad/s"', markov_time='"3h"')),
    World("orbital-drift-3e-8", "drift outside eq. (1)", constant(SLEWS), drifts_at_orbital_period(3e-8)),
    World("warm-up-0.3", "drift outside eq. (1)", drifting(warm_up_fraction=0.3), faults=NOT_CONSTANT),

    World("dirty", "dirty telemetry", constant(DIRTY)),
    World("dirty-degrees", "dirty telemetry", lambda random: DIRTY.replace("[gyro.drift]\n", "[gyro.drift]\n" + members(random, 5e-8) + "\n")),
    World("clock-offset-20ms", "dirty telemetry", tracker(clock_offset='"20ms"')),
    World("orbital-error-15", "dirty telemetry", tracker(orbital_sine='["15arcsec", "-10arcsec", "5arcsec"]', orbital_cosine='["5arcsec", "10arcsec", "-15arcsec"]')),
    World("field-error", "dirty telemetry", tracker(field_error='["2arcsec", "2arcsec", "10arcsec"]'), faults=("innovations-not-white",)),
    World("tracker-alike-20s", "dirty telemetry", constant(SLEWS), tracker_wanders(5 * ARCSECOND, 20)),
    World("tracker-noise-doubles", "dirty telemetry", constant(SLEWS), tracker_noise_grows(2, [3 * ARCSECOND, 3 * ARCSECOND, 20 * ARCSECOND])),
    World("blinded", "dirty telemetry", tracker(sun_exclusion='"40deg"', earth_exclusion='"25deg"')),

    World("noise-in-degrees", "wrong units and sides", constant(SLEWS), in_degrees, faults=("nis-out-of-bounds",)),
    World("readout-noise-told-third", "wrong units and sides", constant(SLEWS), readout_noise_told(1 / 3)),
    World("scalar-first", "wrong units and sides", constant(SLEWS), fixes_by(lambda q: (q[3], q[0], q[1], q[2]))),
    World("conjugate", "wrong units and sides", constant(SLEWS), fixes_by(inverse)),
    World("gyros-exchanged", "wrong units and sides", constant(SLEWS), exchanged),
    World("axis-mirrored", "wrong units and sides", constant(SLEWS), readings_by(lambda h: [h[0], -h[1], *h[2:]])),
    World("axes-exchanged", "wrong units and sides", constant(SLEWS), readings_by(lambda h: [h[1], h[0], *h[2:]])),

    World("frozen-tracker-70s", "faults", constant(SLEWS), frozen(70)),
    World("frozen-tracker-1h", "faults", constant(SLEWS), frozen(3600)),
    World("tracker-slip-20", "faults", constant(SLEWS), tracker_moves(lambda t, axis: scaled(axis, 20 * ARCSECOND if t > PASS_S / 2 else 0)), faults=("star-tracker-moved",)),
    World("tracker-ramp-60", "faults", constant(SLEWS), tracker_moves(lambda t, axis: scaled(axis, 60 * ARCSECOND * t / PASS_S)), faults=("star-tracker-moved",)),
    World("tracker-sine-2n-4", "faults", constant(SLEWS), tracker_moves(lambda t, axis: scaled(axis, 4 * ARCSECOND * math.sin(2 * ORBITAL_RATE_RAD_S * t))), faults=("star-tracker-wanders",)),
    World("tracker-wanders-5", "faults", constant(SLEWS), tracker_wanders(5 * ARCSECOND, 600), faults=("star-tracker-wanders",)),
    World("one-sided-errors", "faults", constant(SLEWS), tracker_off_at_times(0.1, 12 * ARCSECOND), faults=("star-tracker-errors-not-normal",)),
    World("two-heads-mixed", "faults", constant(SLEWS), tracker_off_at_times(0.5, 10 * ARCSECOND), faults=("star-tracker-errors-not-normal",)),
    World("gyro-case-step-20", "faults", constant(SLEWS), case_steps(20 * ARCSECOND), faults=("gyro-mounting-moved",)),
    World("gyro-case-step-60", "faults", constant(SLEWS), case_steps(60 * ARCSECOND), faults=("gyro-mounting-moved",)),
    World("gyro-spikes", "faults", constant(SLEWS), spikes(0.01, math.radians(1))),
    World("inertial-step-1deg", "faults", constant(SLEWS), inertial_step(math.radians(1)), faults=("momentum-jumped",)),
    World("aberration", "faults", tracker(aberration='"uncorrected"'), faults=("aberration-not-corrected",)),
    World("aberration-yaw-steered", "faults", constant(YAW_STEERED + toml(star_tracker={"aberration": '"uncorrected"'})), faults=("orbital-error-or-drift",)),
    World("cosine-scale", "faults", constant(toml(gyro_drift={}, gyro_readout={"scale": "[5e-4, -5e-4, 0]"})), faults=("readout-scale-off",)),
    World("readout-cubic-4", "faults", constant(SLEWS), cubic(4 * ARCSECOND), faults=("readout-error-by-direction",)),
    World("readout-harmonic-1", "faults", constant(SLEWS), harmonic(1 * ARCSECOND, 2), faults=("readout-error-by-direction",)),
    World("gyro-late-125ms", "faults", constant(SLEWS), late(0.125)),
    World("stamps-3s-late", "faults", constant(SLEWS), stamps_of_fixes(lambda t: t + 3)),
    World("clock-100ppm", "faults", constant(SLEWS), stamps_of_fixes(lambda t: t * (1 + 1e-4))),
    World("clock-steps-50ms", "faults", constant(SLEWS), stamps_of_fixes(lambda t: t + 0.05 if 3 * 3600 <= t < 5 * 3600 else t), faults=("clock-stepped",)),
    World("clock-1ppm", "faults", constant(SLEWS), stamps_of_fixes(lambda t: t * (1 + 1e-6))),
]
