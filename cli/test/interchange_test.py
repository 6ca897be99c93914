"""export and import: what they write, refuse, and never replace. Run by CTest with TRIHEDRON_BUILD naming the build directory."""
import datetime
import json
import shutil
import struct
import tomllib

import jsonschema
import pytest
import xarray

from program import DO_NOT_USE, INPUT_REFUSED, TOLD, TRUSTWORTHY, WRONG_USAGE, refused, run

SCENARIO = '[scenario]\nseed = 3\nduration = "4min"\n[gyro]\nperiod = "1s"\n'


def done(*arguments, **options):
    result = run("--quiet", *arguments, **options)
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    return result


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    directory = tmp_path_factory.mktemp("flown")
    (directory / "told.toml").write_text(TOLD)
    done("simulate", "-", "-o", directory / "pass", input=SCENARIO)
    done("calibrate", directory / "pass", "-o", directory / "out", "--config", directory / "told.toml")
    done("navigate", directory / "pass", "--calibration", directory / "out" / "calibration.json", "-o", directory / "a.csv")
    return directory


def numbers(path):
    return [[float(value) for value in line.split(",")[:5]] for line in path.read_text().splitlines()[1:]]


@pytest.mark.parametrize("form", ["aem", "aem-xml"])
@pytest.mark.parametrize("scale", ["TAI", "UTC", "GPS", "TT", "TDB"])
def test_attitude_comes_back(flown, tmp_path, form, scale):
    done("export", flown / "a.csv", "--format", form, "-o", tmp_path / "a", "--pass", flown / "pass", "--time-system", scale)
    done("import", tmp_path / "a", "-o", tmp_path / "b.csv")
    assert numbers(tmp_path / "b.csv") == numbers(flown / "a.csv")


@pytest.mark.parametrize("form", ["apm", "apm-xml"])
def test_attitude_of_one_epoch(flown, tmp_path, form):
    rows = numbers(flown / "a.csv")
    export = ("export", flown / "a.csv", "--format", form, "-o", tmp_path / "a", "--pass", flown / "pass", "--time-system", "UTC")
    done(*export)
    done("import", tmp_path / "a", "-o", tmp_path / "b.csv")
    assert numbers(tmp_path / "b.csv") == [rows[-1]]
    epoch = datetime.datetime.fromisoformat(json.loads(done("--json", "import", tmp_path / "a", "-o", tmp_path / "b.csv").stdout)["epoch_tai"])
    at = epoch + datetime.timedelta(seconds=rows[7][0] - 34)  # TAI − UTC of 2009
    done(*export, "--at", at.isoformat())
    done("import", tmp_path / "a", "-o", tmp_path / "b.csv")
    assert numbers(tmp_path / "b.csv") == [rows[7]]
    done("export", tmp_path / "a", "--format", "aem", "-o", tmp_path / "a.aem")
    done("import", tmp_path / "a.aem", "-o", tmp_path / "b.csv")
    assert numbers(tmp_path / "b.csv") == [rows[7]]
    (tmp_path / "a").unlink()
    refused(run(*export, "--at", (at + datetime.timedelta(seconds=0.1)).isoformat()), WRONG_USAGE, "the nearest is at " + at.isoformat(), "UTC")
    refused(run(*export, "--at", "now"), WRONG_USAGE, "--at: ")
    refused(run("export", flown / "a.csv", "--format", "aem", "-o", tmp_path / "a", "--pass", flown / "pass", "--at", at.isoformat()), WRONG_USAGE,
            "--at", "only to apm")
    assert not (tmp_path / "a").exists()


def test_a_message_is_an_attitude_wherever_one_is_taken(flown, tmp_path):
    done("export", flown / "a.csv", "--format", "aem", "-o", tmp_path / "a.aem", "--pass", flown / "pass", "--time-system", "UTC")
    told = []
    for name in (flown / "a.csv", tmp_path / "a.aem"):
        whole = json.loads(done("--json", "evaluate", flown / "pass", "--attitude", name).stdout)["whole"]
        told.append([whole["epochs"], *whole["rms"].values(), *whole["max"].values()])
    assert told[0][0] > 70 and told[0] == told[1]
    # A recorded attitude, from before a scenario to after it: what is flown is the same to the byte.
    rows = "".join(f"{t},0,0,0.6,0.8\n" for t in range(-1, 243))
    (tmp_path / "rest.csv").write_text("t_s,q_x,q_y,q_z,q_w\n" + rows)
    done("export", tmp_path / "rest.csv", "--format", "aem-xml", "-o", tmp_path / "rest.xml", "--pass", flown / "pass")
    done("export", tmp_path / "rest.csv", "--format", "ck", "-o", tmp_path / "rest.bc", "--pass", flown / "pass")
    for form in ("csv", "xml", "bc"):
        (tmp_path / f"{form}.toml").write_text(SCENARIO + f'[attitude]\nreference = "recorded"\nrecorded = "rest.{form}"\n')
        done("simulate", tmp_path / f"{form}.toml", "-o", tmp_path / form)
    truth = [(tmp_path / form / "truth.csv").read_bytes() for form in ("csv", "xml", "bc")]
    assert truth[0] == truth[1] == truth[2] and len(truth[0].splitlines()) > 2


def test_the_star_tracker_is_not_called_the_body_where_it_is_mounted_otherwise(flown, tmp_path):
    shutil.copytree(flown / "pass", tmp_path / "pass")
    settings = (tmp_path / "pass" / "pass.toml").read_text()
    (tmp_path / "pass" / "pass.toml").write_text(settings.replace("[star_tracker]", "[star_tracker]\nmounting_rotation_vector_rad = [0, 0, 0.5]", 1))
    export = ("export", flown / "a.csv", "--format", "aem", "-o", "-", "--pass", tmp_path / "pass")
    assert "REF_FRAME_B = STARTRACKER_1" in done(*export).stdout
    assert "REF_FRAME_B = SC_BODY_1" in done(*export, "--body-frame", "SC_BODY_1").stdout
    (tmp_path / "pass" / "pass.toml").write_text(settings)
    assert "REF_FRAME_B = SC_BODY_1" in done(*export).stdout


def test_streams(flown, tmp_path):
    text = done("export", "-", "--format", "aem", "-o", "-", "--epoch", "2009-05-20T00:00:00", input=(flown / "a.csv").read_text()).stdout
    assert text.startswith("CCSDS_AEM_VERS = 2.0\n") and "REF_FRAME_A = GCRF" in text and "OBJECT_NAME = UNKNOWN" in text
    back = done("import", "-", "-o", "-", input=text).stdout
    assert len(back.splitlines()) == len((flown / "a.csv").read_text().splitlines())
    refused(run("export", flown / "a.csv", "--format", "ck", "-o", "-", "--pass", flown / "pass"), WRONG_USAGE, "several files")


def test_epoch_is_never_guessed(flown, tmp_path):
    export = ("export", flown / "a.csv", "--format", "aem", "-o", tmp_path / "a.aem")
    refused(run(*export), WRONG_USAGE, "--pass", "--epoch")
    refused(run(*export, "--epoch", "20 May"), WRONG_USAGE, "--epoch 20 May")
    refused(run(*export, "--epoch", "2009-05-20T00:00:00", "--pass", flown / "pass"), WRONG_USAGE)
    assert not (tmp_path / "a.aem").exists()


@pytest.mark.parametrize("arguments, words", [
    (("--time-system", "ET"), ["--time-system ET", "TAI, UTC"]),
    (("--inertial-frame", "ITRF2014"), ["--inertial-frame ITRF2014", "ICRF"]),
    (("--body-frame", "Body"), ["--body-frame Body", "SC_BODY_1"]),
    (("--object-id", ""), ["--object-id"]),
    (("--object-name", "Спутник"), ["ASCII"]),
    (("--gap", "3"), ["3"]),
    (("--created", "today"), ["--created"]),
    (("--epoch", "1960-01-01T00:00:00", "--time-system", "UTC"), ["leap seconds"]),
    (("--format", "oem"), ["oem"]),
])
def test_wrong_options_are_refused(flown, tmp_path, arguments, words):
    given = ("--format", "aem") if "--format" not in arguments else ()
    epoch = ("--epoch", "2009-05-20T00:00:00") if "--epoch" not in arguments else ()
    refused(run("export", flown / "a.csv", "-o", tmp_path / "a.aem", *given, *epoch, *arguments), WRONG_USAGE, *words)
    assert not (tmp_path / "a.aem").exists()


def test_a_c_kernel_is_an_attitude_wherever_one_is_taken(flown, tmp_path):
    done("export", flown / "a.csv", "--format", "ck", "-o", tmp_path / "a.bc", "--pass", flown / "pass")
    said = json.loads(done("--json", "import", tmp_path / "a.bc", "-o", tmp_path / "b.csv", "--pass", flown / "pass").stdout)
    assert said["epochs"] == len(numbers(flown / "a.csv")) and said["inertial_frame"] == "J2000"
    for row, back in zip(numbers(flown / "a.csv"), numbers(tmp_path / "b.csv"), strict=True):
        assert back == pytest.approx(row, rel=0, abs=1e-12)  # of twelve decimals, normalised
    of_truth = [json.loads(done("--json", "evaluate", flown / "pass", "--attitude", flown / "a.csv", *truth).stdout)
                for truth in ((), ("--truth", flown / "pass" / "truth.csv"), ("--truth", tmp_path / "a.bc"))]
    assert of_truth[0] == of_truth[1]
    assert list(of_truth[2]["whole"]["max"].values()) == pytest.approx([0, 0, 0], abs=1e-11)
    (tmp_path / "a.tsc").unlink()
    refused(run("import", tmp_path / "a.bc", "-o", tmp_path / "b.csv"), INPUT_REFUSED, "a.tsc is not there")
    refused(run("evaluate", flown / "pass", "--attitude", flown / "a.csv", "--truth", tmp_path / "b"), INPUT_REFUSED)


@pytest.mark.parametrize("form, option, value, of", [
    ("aem", "--at", "2009-05-20T00:00:00", "apm"), ("apm", "--gap", "1s", "aem, ck, acm"), ("ck", "--time-system", "UTC", "aem, apm, acm"),
    ("ck", "--apid", "40", "packets"), ("aem-xml", "--naif-id", "-28380", "ck, fk"), ("fk", "--attitude", "a.csv", "acm"),
    ("fk", "--epoch", "2009-05-20T00:00:00", "aem, apm, ck"), ("acm-xml", "--naif-id", "-28380", "ck, fk"),
    ("packets", "--body-frame", "SC_BODY_1", "aem, apm, acm"), ("packets", "--object-name", "X", "aem, apm, ck, acm, fk")])
def test_options_of_other_formats_are_refused(flown, tmp_path, form, option, value, of):
    of_calibration = form in ("acm-xml", "fk")
    file = flown / "pass" if form == "packets" else flown / "out" / "calibration.json" if of_calibration else flown / "a.csv"
    epoch = () if of_calibration or form == "packets" else ("--pass", flown / "pass")
    refused(run("export", file, "--format", form, "-o", tmp_path / "x", *epoch, option, value), WRONG_USAGE, f"{option} is of no use to --format {form}",
            f"only to {of}: leave it out")
    refused(run("export", flown / "out" / "calibration.json", "--format", "acm", "-o", tmp_path / "x", "--gap", "1s"), WRONG_USAGE, "--attitude")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("naif_id", ["0", "5", "-2000001"])
def test_wrong_numbers_of_spacecraft_are_refused(flown, tmp_path, naif_id):
    refused(run("export", flown / "a.csv", "--format", "ck", "-o", tmp_path / "a.bc", "--pass", flown / "pass", "--naif-id", naif_id), WRONG_USAGE,
            "--naif-id")


def test_what_is_read_is_never_replaced(flown, tmp_path):
    (tmp_path / "a.csv").write_text((flown / "a.csv").read_text())
    export = ("--epoch", "2009-05-20T00:00:00")
    refused(run("export", tmp_path / "a.csv", "--format", "aem", "-o", tmp_path / "a.csv", *export), WRONG_USAGE)
    (tmp_path / "b.tf").write_text((flown / "a.csv").read_text())
    refused(run("export", tmp_path / "b.tf", "--format", "ck", "-o", tmp_path / "b.bc", *export), WRONG_USAGE)
    refused(run("export", tmp_path / "a.csv", "--format", "ck", "-o", tmp_path / "c.tf", *export), WRONG_USAGE)
    refused(run("export", flown / "a.csv", "--format", "aem", "-o", flown / "pass" / "a.aem", "--pass", flown / "pass"), WRONG_USAGE)
    done("export", tmp_path / "a.csv", "--format", "aem", "-o", tmp_path / "a.aem", *export)
    refused(run("import", tmp_path / "a.aem", "-o", tmp_path / "a.aem"), WRONG_USAGE)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.aem", "a.csv", "b.tf"]


def test_the_prior_of_a_pass_is_not_replaced(flown, tmp_path):
    shutil.copytree(flown / "pass", tmp_path / "pass")
    settings = tmp_path / "pass" / "pass.toml"
    settings.write_text(settings.read_text().replace("[pass]", '[pass]\nprior = "../known.json"', 1))
    known = (flown / "out" / "calibration.json").read_bytes()
    (tmp_path / "known.json").write_bytes(known)
    refused(run("export", flown / "a.csv", "--format", "aem", "--pass", tmp_path / "pass", "-o", tmp_path / "known.json"), WRONG_USAGE, "replace")
    assert (tmp_path / "known.json").read_bytes() == known


@pytest.mark.parametrize("gap", ["0s", "1ns"])
def test_a_gap_is_a_time_between_epochs(flown, tmp_path, gap):
    refused(run("export", flown / "a.csv", "--format", "aem", "--pass", flown / "pass", "--gap", gap, "-o", tmp_path / "a.aem"), WRONG_USAGE, "--gap")


def test_what_is_of_another_kind_is_refused_for_what_it_is(flown, tmp_path):
    exporting = ("-o", tmp_path / "none")
    refused(run("export", flown / "pass" / "truth.json", "--format", "aem", *exporting), INPUT_REFUSED, "truth.json: is JSON", "`export` writes acm, acm-xml and fk")
    refused(run("export", flown / "a.csv", "--format", "acm", *exporting), INPUT_REFUSED, "a.csv: is no calibration.json", "ACM")
    (tmp_path / "empty.json").write_text("")
    refused(run("export", tmp_path / "empty.json", "--format", "fk", *exporting), INPUT_REFUSED, "empty.json: is no calibration.json")
    assert not (tmp_path / "none").exists()


def test_what_is_no_message_is_refused(flown, tmp_path):
    for name in ("a.csv", "pass/truth.json", "pass/gyro.csv"):
        refused(run("import", flown / name, "-o", tmp_path / "b.csv"), INPUT_REFUSED, "is nothing that can be imported; give a telemetry.toml, a pass, or a message")
    (tmp_path / "wide.aem").write_text("CCSDS_AEM_VERS = 2.0\n", encoding="utf-16")
    refused(run("import", tmp_path / "wide.aem", "-o", tmp_path / "b.csv"), INPUT_REFUSED, "wide.aem:1:1: is UTF-16")
    (tmp_path / "cut.aem").write_text(
        done("export", flown / "a.csv", "--format", "aem", "-o", "-", "--pass", flown / "pass").stdout[:3000])
    refused(run("evaluate", flown / "pass", "--attitude", tmp_path / "cut.aem"), INPUT_REFUSED, "cut.aem:", ";")
    assert not (tmp_path / "b.csv").exists()


def test_kernels_of_an_attitude(flown, tmp_path):
    done("export", flown / "a.csv", "--format", "ck", "-o", tmp_path / "a.bc", "--pass", flown / "pass", "--naif-id", "-28380")
    kernel = (tmp_path / "a.bc").read_bytes()
    assert kernel.startswith(b"DAF/CK  ") and len(kernel) % 1024 == 0
    assert struct.unpack("<6i", kernel[1064:1088])[:4] == (-28380000, 1, 3, 1)
    assert "SCLK_DATA_TYPE_28380 = ( 1 )" in (tmp_path / "a.tsc").read_text()
    assert "FRAME_-28380000_CLASS = 3" in (tmp_path / "a.tf").read_text()


@pytest.mark.parametrize("form", ["acm", "acm-xml"])
def test_calibration_as_message_with_its_covariance(flown, tmp_path, form):
    calibration = json.loads((flown / "out" / "calibration.json").read_text())
    done("export", flown / "out" / "calibration.json", "--format", form, "-o", tmp_path / "c.acm", "--pass", flown / "pass", "--attitude",
         flown / "a.csv")
    text = (tmp_path / "c.acm").read_text()
    assert f"{calibration['gyros'][1]['drift_rad_s']['k0']:.15e}" in text
    assert "c.covariance.nc" in text
    with xarray.open_dataset(tmp_path / "c.covariance.nc") as covariance:
        assert list(covariance.state.values) == calibration["covariance"]["states"]
        assert (covariance.covariance.values == calibration["covariance"]["matrix"]).all()


@pytest.mark.parametrize("form, scale", [("acm", "UTC"), ("acm-xml", "TT")])
def test_calibration_comes_back_from_its_message(flown, tmp_path, form, scale):
    original = flown / "out" / "calibration.json"
    done("export", original, "--format", form, "-o", tmp_path / "c.acm", "--pass", flown / "pass", "--attitude", flown / "a.csv",
         "--time-system", scale)
    said = json.loads(done("--json", "import", tmp_path / "c.acm", "-o", tmp_path / "back.json").stdout)
    assert (said["output_format"], said["time_system"], said["inertial_frame"]) == ("calibration", scale, "GCRF")
    expected, back = (json.loads(path.read_text()) for path in (original, tmp_path / "back.json"))
    assert back["covariance"] == expected["covariance"]
    for ours, theirs in zip(back["gyros"], expected["gyros"], strict=True):
        assert list(ours["drift_rad_s"]) == list(theirs["drift_rad_s"])
        for name in theirs["drift_rad_s"]:
            assert ours["drift_rad_s"][name] == pytest.approx(theirs["drift_rad_s"][name], rel=1e-15, abs=0)
    assert [finding["code"] for finding in back["verdict"]["findings"]] == [finding["code"] for finding in expected["verdict"]["findings"]]
    assert {key for key in expected if key not in back} <= {"forecast"}
    # Navigation by it is the same to the digits that the message has.
    done("navigate", flown / "pass", "--calibration", tmp_path / "back.json", "-o", tmp_path / "b.csv")
    for ours, theirs in zip(numbers(tmp_path / "b.csv"), numbers(flown / "a.csv"), strict=True):
        assert ours == pytest.approx(theirs, rel=0, abs=1e-12)


def test_calibration_from_a_message_without_its_covariance(flown, tmp_path):
    done("export", flown / "out" / "calibration.json", "--format", "acm", "-o", tmp_path / "c.acm")
    (tmp_path / "c.covariance.nc").unlink()
    result = run("import", tmp_path / "c.acm", "-o", tmp_path / "back.json")
    assert result.returncode == TRUSTWORTHY and not result.stderr
    assert "covariance diagonal" in result.stdout and "c.covariance.nc is not there" in result.stdout
    matrix = json.loads((tmp_path / "back.json").read_text())["covariance"]["matrix"]
    assert all(value == 0 for i, row in enumerate(matrix) for j, value in enumerate(row) if i != j)
    done("navigate", flown / "pass", "--calibration", tmp_path / "back.json", "-o", tmp_path / "b.csv")
    text = (tmp_path / "c.acm").read_text()
    (tmp_path / "d.acm").write_text(text.replace("GYRO1_K0_RAD_S", "GYRO1_K9_RAD_S"))
    refused(run("import", tmp_path / "d.acm", "-o", tmp_path / "d.json"), INPUT_REFUSED, "d.acm:", "no USER_DEFINED_TRIHEDRON_GYRO1_K0_RAD_S", "; ")
    refused(run("import", tmp_path / "c.acm", "-o", tmp_path / "d.json", "--pass", flown / "pass"), WRONG_USAGE, "--pass and --epoch")
    assert not (tmp_path / "d.json").exists()


def test_calibration_as_frames(flown, tmp_path):
    text = done("export", flown / "out" / "calibration.json", "--format", "fk", "-o", "-", "--object-name", "RESURS-DK1").stdout
    for words in ("FRAME_RESURS-DK1_GYRO2 = -999002", "TKFRAME_-999002_SPEC = 'MATRIX'", "INS-999001_DRIFT_RAD_S"):
        assert words in text
    refused(run("export", flown / "out" / "calibration.json", "--format", "fk", "-o", "-", "--object-name", "1"), WRONG_USAGE)
    refused(run("export", flown / "a.csv", "--format", "fk", "-o", "-"), INPUT_REFUSED)


def test_a_pass_as_space_packets_is_the_same_pass(flown, tmp_path):
    said = json.loads(done("--json", "export", flown / "pass", "--format", "packets", "-o", tmp_path / "p.ccsds", "--apid", "40").stdout)
    assert said["written"] == [str(tmp_path / f"p.{ending}") for ending in ("ccsds", "toml", "xtce.xml")]
    assert said["epochs"] == sum(len((flown / "pass" / name).read_text().splitlines()) - 1 for name in ("gyro.csv", "star_tracker.csv"))
    schema = json.loads(run("schema", "telemetry").stdout)
    document = tomllib.loads((tmp_path / "p.toml").read_text())
    jsonschema.validate(document, schema)
    assert not jsonschema.Draft202012Validator(schema).is_valid({**document, "telemetry": {**document["telemetry"], "gyro": {}}})
    done("calibrate", tmp_path / "p.toml", "-o", tmp_path / "out", "--config", flown / "told.toml")
    for name in ("calibration.json", "attitude.csv"):
        assert (tmp_path / "out" / name).read_text() == (flown / "out" / name).read_text()
    # With an earlier calibration, which goes along, and from packets to packets.
    (tmp_path / "p.toml").write_text(
        (tmp_path / "p.toml").read_text().replace("[pass]\n", f'[pass]\nprior = "{flown / "out" / "calibration.json"}"\n', 1))
    done("export", tmp_path / "p.toml", "--format", "packets", "-o", tmp_path / "again.ccsds", "--apid", "40")
    assert (tmp_path / "again.ccsds").read_bytes() == (tmp_path / "p.ccsds").read_bytes()
    assert 'prior = "again.prior.json"' in (tmp_path / "again.toml").read_text()
    done("inspect", tmp_path / "again.toml")


def test_damaged_space_packets_are_said_with_their_place(flown, tmp_path):
    done("export", flown / "pass", "--format", "packets", "-o", tmp_path / "p.ccsds")
    octets = bytearray((tmp_path / "p.ccsds").read_bytes())
    octets[100] ^= 1  # in the second packet, which begins at 77
    (tmp_path / "p.ccsds").write_bytes(octets)
    (defect,) = json.loads(done("--json", "inspect", tmp_path / "p.toml").stdout)["defects"][:1]
    assert (defect["kind"], defect["count"]) == ("packet-damaged", 1)
    assert defect["text"].endswith("left out: packet 2 at octet 77.")
    (tmp_path / "p.ccsds").write_bytes(octets[:-20])
    refused(run("inspect", tmp_path / "p.toml"), INPUT_REFUSED, "p.ccsds: packet", "is cut short", "; get the file again")
    refused(run("inspect", tmp_path / "p.ccsds"), INPUT_REFUSED, "is no NetCDF-4 file", "telemetry.toml")


def test_space_packets_replace_nothing_that_is_read(flown, tmp_path):
    done("export", flown / "pass", "--format", "packets", "-o", tmp_path / "p.ccsds")
    for file, output in ((flown / "pass", flown / "pass" / "p.ccsds"), (tmp_path / "p.toml", tmp_path / "p.ccsds"),
                         (tmp_path / "p.toml", tmp_path / "p.toml"), (flown / "pass", "-")):
        refused(run("export", file, "--format", "packets", "-o", output), WRONG_USAGE, "output" if output != "-" else "several files")
    refused(run("export", flown / "pass", "--format", "packets", "-o", tmp_path / "x.ccsds", "--pass", flown / "pass"), WRONG_USAGE, "--pass")
    refused(run("export", flown / "pass", "--format", "packets", "-o", tmp_path / "x.ccsds", "--apid", "2046"), WRONG_USAGE, "2045 at most")
    assert not (tmp_path / "x.ccsds").exists()
