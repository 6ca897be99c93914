"""telemetry.toml: others' columns become a pass; inspect proposes the lines that mend mistakes. Run by CTest with TRIHEDRON_BUILD naming the build directory."""
import csv
import json
import math
import shutil
import tomllib

import jsonschema
import pytest
import xarray

from program import DO_NOT_USE, INPUT_REFUSED, ROOT, TOLD, TRUSTWORTHY, WRONG_USAGE, refused, run

EXAMPLE = ROOT / "examples" / "telemetry"


def done(*arguments, **options):
    result = run(*arguments, **options)
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    return result


def rows(path):
    with open(path) as file:
        return [[float(value) for value in row] for row in list(csv.reader(file))[1:]]


def write_rows(path, names, table):
    path.write_text(",".join(names) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in table))


def test_the_example_becomes_a_pass(tmp_path):
    text = done("import", EXAMPLE / "telemetry.toml", "-o", tmp_path / "pass").stdout
    assert "1 fix whose sigma is too large" in text and "20 rows in excluded intervals" in text and "outside the time range" in text
    done("--quiet", "import", EXAMPLE / "telemetry.toml", "-o", tmp_path / "pass.nc")
    gyro, fixes = rows(tmp_path / "pass/gyro.csv"), rows(tmp_path / "pass/star_tracker.csv")
    assert len(gyro) == 181 and len(fixes) == 59
    with xarray.open_dataset(tmp_path / "pass.nc", group="gyro", decode_times=False) as same:
        assert abs(same.h2_y.values - [row[5] for row in gyro]).max() < 1e-9
    # The first fix after 00:00:00 UTC, 34 s after the first of the file, in which the scalar is first and the quaternion is the conjugate.
    with open(EXAMPLE / "star_tracker.csv") as file:
        told = [float(value) for value in list(csv.reader(file))[13][1:5]]
    assert fixes[0][:5] == [2.0, -told[1], -told[2], -told[3], told[0]]
    assert fixes[0][5:] == pytest.approx([math.radians(sigma / 3600) ** 2 for sigma in (3, 3, 20)] + [0, 0, 0], rel=1e-12)
    settings = tomllib.loads((tmp_path / "pass/pass.toml").read_text())
    assert settings["pass"] | {"duration_s": 0} == {"spacecraft": "RESURS-DK1-LIKE", "epoch_tai": "2009-05-20T00:00:34", "duration_s": 0,
                                                    "inertial_frame": "EME2000"}
    assert settings["gyro"]["period_s"] == 1 and settings["star_tracker"]["period_s"] == 3
    assert settings["star_tracker"]["noise_rad"][2] == pytest.approx(math.radians(20 / 3600), rel=1e-12)


def test_a_part_of_a_simulated_pass_keeps_its_truth(tmp_path):
    (tmp_path / "scenario.toml").write_text('[scenario]\nduration = "10min"\n')
    done("--quiet", "simulate", tmp_path / "scenario.toml", "-o", tmp_path / "whole")
    done("--quiet", "import", tmp_path / "whole", "-o", tmp_path / "part.nc", "--from", "2009-05-20T00:01:00", "--to", "2009-05-20T00:05:00")
    done("--quiet", "import", tmp_path / "part.nc", "-o", tmp_path / "part")
    truth = rows(tmp_path / "whole/truth.csv")
    assert rows(tmp_path / "part/truth.csv") == [[row[0] - 60, *row[1:]] for row in truth if 60 <= row[0] <= 300]
    assert json.loads((tmp_path / "part/truth.json").read_text())["gyros"] == json.loads((tmp_path / "whole/truth.json").read_text())["gyros"]
    # A truth that is not whole is left out, and this is told.
    (tmp_path / "part/truth.json").unlink()
    assert "1 truth that is not whole" in done("import", tmp_path / "part", "-o", tmp_path / "without").stdout
    assert not (tmp_path / "without/truth.csv").exists()


def test_every_command_takes_it_as_a_pass(tmp_path):
    (tmp_path / "told.toml").write_text(TOLD)
    told = ("--config", tmp_path / "told.toml")
    mounted = tmp_path / "mounted"
    shutil.copytree(EXAMPLE, mounted)
    toml = (mounted / "telemetry.toml").read_text()
    (mounted / "telemetry.toml").write_text(toml.replace("mounting_rotation_vector_rad = [0, 0, 0]  # in", "mounting_rotation_vector_rad = [0, 0, 0.5]  # in")
                                            .replace("mounting_rotation_vector_rad = [0, 0, 0]  # of", "mounting_rotation_vector_rad = [0, 0, 0.5]  # of")
                                            .replace("[[gyro.unit]]\nmounting_rotation_vector_rad = [0, 0, 0]\n",
                                                     "[[gyro.unit]]\nmounting_rotation_vector_rad = [0, 0, 0.5]\n"))
    pass_ = mounted / "telemetry.toml"
    done("--quiet", "calibrate", pass_, "-o", tmp_path / "out", *told)
    for attitude, command in (("a.csv", ("navigate", pass_, "--online")), ("r.csv", ("replay", pass_, "--speed", "max"))):
        done("--quiet", *command, "-o", tmp_path / attitude, *told)
        lines = (tmp_path / attitude).read_text().splitlines()
        names = lines[0].split(",")
        assert names[-4:] == ["q_body_x", "q_body_y", "q_body_z", "q_body_w"]
        # q_in_body = q_in_c ⊗ (0, 0, −sin 0.25, cos 0.25)
        q, body = [float(v) for v in lines[-1].split(",")[1:5]], [float(v) for v in lines[-1].split(",")[-4:]]
        s, c = -math.sin(0.25), math.cos(0.25)
        assert body == pytest.approx([c * q[0] + s * q[1], c * q[1] - s * q[0], c * q[2] + s * q[3], c * q[3] - s * q[2]], abs=2e-12)
    done("--quiet", "observe", pass_, *told)
    done("--quiet", "evaluate", pass_, "--attitude", tmp_path / "a.csv")
    done("--quiet", "export", tmp_path / "a.csv", "--format", "aem", "-o", tmp_path / "a.aem", "--pass", pass_)
    assert "REF_FRAME_A = EME2000" in (tmp_path / "a.aem").read_text()


def test_ranges_and_intervals_cut_any_pass(tmp_path):
    done("--quiet", "import", EXAMPLE / "telemetry.toml", "-o", tmp_path / "whole")
    (tmp_path / "out.csv").write_text("begin,end,why\n2009-05-20T00:02:00,2009-05-20T00:02:09.5,test\n")
    told = json.loads(done("--json", "import", tmp_path / "whole", "-o", tmp_path / "part", "--from", "2009-05-20T00:01:00Z", "--to", "2009-05-20T00:02:30",
                           "--exclude", tmp_path / "out.csv", "--time-system", "UTC").stdout)
    assert told["epoch_tai"] == "2009-05-20T00:01:34" and told["duration_s"] == 90
    # 90 s with both ends, without the 20 s of the example and the 10 s here.
    assert told["gyro_samples"] == 91 - 20 - 10 == len(rows(tmp_path / "part/gyro.csv"))
    assert {defect["kind"] for defect in told["defects"]} >= {"outside-range", "excluded"}


def test_what_does_not_go_together_is_wrong_usage(tmp_path):
    importing = ("import", EXAMPLE / "telemetry.toml", "-o", tmp_path / "pass")
    refused(run(*importing, "--epoch", "2009-05-20T00:00:00"), WRONG_USAGE, "--epoch")
    refused(run(*importing, "--from", "noon"), WRONG_USAGE, "--from", "noon")
    refused(run(*importing, "--from", "2009-05-20T00:00:00", "--time-system", "MSK"), WRONG_USAGE, "MSK", "TAI")
    refused(run(*importing, "--from", "2009-05-20T00:00:00Z"), WRONG_USAGE, "Z")
    refused(run(*importing, "--from", "2009-05-20T00:03:30"), INPUT_REFUSED, "less than a minute")
    refused(run(*importing, "--exclude", EXAMPLE / "slews.csv"), INPUT_REFUSED, "slews.csv:1", "begin")
    refused(run("import", EXAMPLE / "slews.csv", "-o", tmp_path / "a.csv", "--to", "2009-05-20T00:00:00"), WRONG_USAGE, "--to")
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def read_by_a_map(tmp_path_factory):
    """The example, beside it a calibration of it and an attitude in two forms."""
    directory = tmp_path_factory.mktemp("map") / "mine"
    shutil.copytree(EXAMPLE, directory)
    run("calibrate", directory / "telemetry.toml", "-o", directory.parent / "out")
    for name in ("attitude.csv", "calibration.json"):
        shutil.copy(directory.parent / "out" / name, directory)
    done("export", directory / "attitude.csv", "--format", "aem", "--pass", directory / "telemetry.toml", "-o", directory / "attitude.aem")
    return directory


def test_what_is_read_is_never_replaced(tmp_path):
    directory = tmp_path / "mine"
    shutil.copytree(EXAMPLE, directory)
    before = {path.name: path.read_bytes() for path in directory.iterdir()}
    for output in (directory / "telemetry.toml", directory / "gyros.csv"):
        refused(run("import", directory / "telemetry.toml", "-o", output), WRONG_USAGE, "replace")
    (directory / "star_tracker.csv").rename(tmp_path / "star_tracker.csv")
    toml = (directory / "telemetry.toml").read_text().replace('"star_tracker.csv"', '"../star_tracker.csv"')
    (directory / "telemetry.toml").write_text(toml)
    refused(run("import", directory / "telemetry.toml", "-o", tmp_path), WRONG_USAGE, "star_tracker.csv")
    assert (tmp_path / "star_tracker.csv").read_bytes() == before["star_tracker.csv"]


@pytest.mark.parametrize("command", [
    ("navigate", "telemetry.toml", "--prior", "-o", "gyros.csv"),
    ("replay", "telemetry.toml", "--speed", "max", "-o", "gyros.csv"),
    ("replay", "telemetry.toml", "--speed", "max", "--calibration", "gyros.csv"),
    ("replay", "telemetry.toml", "--speed", "max", "--state", "star_tracker.csv"),
    ("replay", "telemetry.toml", "--speed", "max", "--records", "star_tracker.csv"),
    ("export", "telemetry.toml", "--format", "packets", "-o", "gyros.csv"),
    ("export", "attitude.csv", "--format", "aem", "--pass", "telemetry.toml", "-o", "gyros.csv"),
    ("export", "calibration.json", "--format", "fk", "--pass", "telemetry.toml", "-o", "gyros.csv"),
    ("import", "attitude.aem", "--pass", "telemetry.toml", "-o", "gyros.csv"),
    ("import", "telemetry.toml", "-o", "gyros.csv"),
], ids=" ".join)
def test_no_command_replaces_the_files_that_a_telemetry_toml_names(read_by_a_map, command):
    before = {path.name: path.read_bytes() for path in read_by_a_map.iterdir()}
    refused(run(*command, cwd=read_by_a_map), WRONG_USAGE, "replace")
    assert {path.name: path.read_bytes() for path in read_by_a_map.iterdir()} == before


@pytest.mark.long
def test_the_schema_describes_the_example_and_refuses_what_the_reader_refuses(tmp_path):
    schema = json.loads(done("schema", "telemetry").stdout)
    validator = jsonschema.Draft202012Validator(schema)
    text = (EXAMPLE / "telemetry.toml").read_text()
    validator.validate(tomllib.loads(text))
    shutil.copytree(EXAMPLE, tmp_path / "edited")
    lines = text.splitlines()
    edits = ["not_a_key = 1\n" + text]
    for i, line in enumerate(lines):
        if line.startswith("["):
            edits.append("\n".join([*lines[:i + 1], "not_a_key = 1", *lines[i + 1:]]))
        elif " = " in line and not line.startswith("#"):
            edits.append("\n".join([*lines[:i], line.split(" = ")[0] + " = true", *lines[i + 1:]]))
    # In place of the sigmas.
    edits.append(text.replace('sigma = ["SX", "SY", "SZ"]', "covariance = true"))
    validator.validate(tomllib.loads(text.replace('sigma = ["SX", "SY", "SZ"]', 'covariance = ["SX", "SY", "SZ", "SX", "SY", "SZ"]')))
    assert len(edits) > 40
    for edited in edits:
        assert not validator.is_valid(tomllib.loads(edited)), edited
        (tmp_path / "edited/telemetry.toml").write_text(edited)
        refused(run("inspect", tmp_path / "edited/telemetry.toml"), INPUT_REFUSED, "telemetry.toml:", ";")


# ---- inspect

SCENARIO = '[scenario]\nseed = 3\nduration = "70min"\n[gyro]\nperiod = "1s"\n'
MAP = """[pass]
spacecraft = "X"
epoch_tai = "2009-05-20T00:00:00"
duration_s = 4200
[gyro]
readout_noise_rad = 9.7e-6
drift_prior_sigma_rad_s = 2e-6
alignment_prior_sigma_rad = 8.7e-3
[star_tracker]
noise_rad = [1.5e-5, 1.5e-5, 9.7e-5]
{clock}
[telemetry.time]
scale = "TAI"
format = "s"
since = "2009-05-20T00:00:00"
[telemetry.gyro]
file = "gyro.csv"
time_column = "t_s"
[[telemetry.gyro.unit]]
{gyro1}
[[telemetry.gyro.unit]]
{gyro2}
[telemetry.star_tracker]
file = "star_tracker.csv"
time_column = "t_s"
{star_tracker}
"""
RIGHT = {"clock": "", "gyro1": 'direction = ["h1_x", "h1_y", "h1_z"]', "gyro2": 'direction = ["h2_x", "h2_y", "h2_z"]',
         "star_tracker": 'quaternion = ["q_x", "q_y", "q_z", "q_w"]\nscalar = "last"\nmaps = "tracker-to-inertial"'}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    directory = tmp_path_factory.mktemp("flown")
    done("--quiet", "simulate", "-", "-o", directory / "pass", input=SCENARIO)
    return directory / "pass"


def spoil_fixes(edit):
    return lambda gyro, fixes: (gyro, [[row[0], *edit(row[1:])] for row in fixes])


def spoil_gyro(edit):
    return lambda gyro, fixes: ([[row[0], *edit(row[1:4]), *row[4:]] for row in gyro], fixes)


MISTAKES = {
    "scalar first": (spoil_fixes(lambda q: [q[3], *q[:3]]), "star_tracker", "the scalar is the first"),
    "scalar last, told as first": (spoil_fixes(list), "star_tracker", "the scalar is the last component, and told as the first",
                                   RIGHT | {"star_tracker": RIGHT["star_tracker"].replace('"last"', '"first"')}),
    "conjugate": (spoil_fixes(lambda q: [-q[0], -q[1], -q[2], q[3]]), "star_tracker", "(conjugate)"),
    "axes in turn": (spoil_fixes(lambda q: [q[1], q[2], q[0], q[3]]), "star_tracker", "another order (what is told as z is x, x is y, y is z)"),
    "mirrored": (spoil_fixes(lambda q: [q[0], -q[1], q[2], q[3]]), "star_tracker", "mirrored along y"),
    "gyro axes exchanged": (spoil_gyro(lambda h: [h[2], h[1], h[0]]), "gyro1", "readings of gyro 1: axes in another order (what is told as z is x, x is z)"),
    "gyro mirrored": (spoil_gyro(lambda h: [h[0], -h[1], h[2]]), "gyro1", "readings of gyro 1: mirrored along y"),
    "late": (lambda gyro, fixes: (gyro, [[row[0] + 599.4, *row[1:]] for row in fixes if row[0] < 3600]), "clock", "fixes were taken -599.4"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_lines_that_inspect_proposes_mend_the_pass(flown, tmp_path, mistake):
    spoil, part, words, *told_wrongly = MISTAKES[mistake]
    gyro, fixes = spoil(rows(flown / "gyro.csv"), rows(flown / "star_tracker.csv"))
    write_rows(tmp_path / "gyro.csv", ["t_s", "h1_x", "h1_y", "h1_z", "h2_x", "h2_y", "h2_z"], gyro)
    write_rows(tmp_path / "star_tracker.csv", ["t_s", "q_x", "q_y", "q_z", "q_w"], fixes)
    (tmp_path / "telemetry.toml").write_text(MAP.format(**(told_wrongly or [RIGHT])[0]))
    told = json.loads(done("--json", "inspect", tmp_path / "telemetry.toml").stdout)["consistency"]
    assert not told["consistent"] and len(told["mistakes"]) == 1, told
    assert words in told["mistakes"][0]["text"], told
    assert words in done("inspect", tmp_path / "telemetry.toml").stdout
    lines = "\n".join(line for line in told["proposal"] if not line.startswith("["))
    (tmp_path / "telemetry.toml").write_text(MAP.format(**RIGHT | {part: lines}))
    told = json.loads(done("--json", "inspect", tmp_path / "telemetry.toml").stdout)["consistency"]
    assert told["consistent"] and not told["mistakes"] and not told["proposal"], told


def test_inspect_says_nothing_of_mistakes_in_a_right_pass(flown):
    told = json.loads(done("--json", "inspect", flown).stdout)
    assert told["consistency"]["consistent"] and not told["consistency"]["mistakes"]
    assert told["periods"] == {"gyro_s": 1.0, "gyro_told_s": 1.0, "star_tracker_s": 3.0, "star_tracker_told_s": 3.0}
    text = done("inspect", flown).stdout
    assert "Mistake" not in text and "told 1 s" in text


def test_fixes_of_another_pass_are_not_mended(flown, tmp_path):
    done("--quiet", "simulate", "-", "-o", tmp_path / "other", input=SCENARIO.replace("seed = 3", "seed = 4"))
    shutil.copytree(flown, tmp_path / "mixed")
    shutil.copy(tmp_path / "other/star_tracker.csv", tmp_path / "mixed/star_tracker.csv")
    told = json.loads(done("--json", "inspect", tmp_path / "mixed").stdout)["consistency"]
    assert not told["consistent"] and [mistake["kind"] for mistake in told["mistakes"]] == ["unexplained"] and not told["proposal"]
    assert "another pass" in done("inspect", tmp_path / "mixed").stdout
