"""CCSDS messages, with ccsds-ndm-py and Orekit as peers."""
import datetime

import ccsds_ndm
import numpy as np
import orekit_jpype
import pytest
from conftest import EPOCH, read_attitude, run

orekit_jpype.initVM()
from java.io import File  # noqa: E402
from java.lang import StringBuilder  # noqa: E402
from org.orekit.data import DataContext, DataSource, DirectoryCrawler  # noqa: E402
from org.orekit.files.ccsds.ndm import ParserBuilder, WriterBuilder  # noqa: E402
from org.orekit.files.ccsds.utils.generation import KvnGenerator, XmlGenerator  # noqa: E402
from org.orekit.time import AbsoluteDate, TimeScalesFactory  # noqa: E402

# When each number of leap seconds since 1999 began.
LEAP_SECONDS = ((1999, "JAN", 32), (2006, "JAN", 33), (2009, "JAN", 34), (2012, "JUL", 35), (2015, "JUL", 36), (2017, "JAN", 37))
# UTC − TAI and the like at the epoch, s; TDB by what Orekit computes.
SCALES = ("TAI", "UTC", "GPS", "TT")
FORMATS = ("aem", "aem-xml")


@pytest.fixture(scope="session", autouse=True)
def leap_seconds(tmp_path_factory):
    """Orekit takes them from a file of the form of the IERS."""
    directory = tmp_path_factory.mktemp("orekit")
    lines = [" 1972 JAN  1 =JD 2441317.5  TAI-UTC=  10.0       S + (MJD - 41317.) X 0.0      S"]
    for year, month, seconds in LEAP_SECONDS:
        day = datetime.date(year, 1 if month == "JAN" else 7, 1).toordinal() + 1721424.5
        lines.append(f" {year} {month}  1 =JD {day:.1f}  TAI-UTC=  {seconds}.0       S + (MJD - 41317.) X 0.0      S")
    (directory / "tai-utc.dat").write_text("\n".join(lines) + "\n")
    DataContext.getDefault().getDataProvidersManager().addProvider(DirectoryCrawler(File(str(directory))))


def exported(attitude, directory, form, scale):
    path = directory / f"attitude.{form}"
    run("--quiet", "export", attitude.path, "--format", form, "-o", path, "--epoch", EPOCH, "--time-system", scale,
        "--object-name", "RESURS-DK1", "--object-id", "2006-021A")
    return path


def orekit_parser():
    return ParserBuilder().buildAemParser()


def states_of_orekit(aem):
    """Seconds since the epoch, and quaternions, scalar last."""
    epoch = AbsoluteDate(EPOCH, TimeScalesFactory.getTAI())
    states = [state for segment in aem.getSegments() for state in segment.getData().getAngularCoordinates()]
    t_s = np.array([state.getDate().durationFrom(epoch) for state in states])
    rotations = [state.getRotation() for state in states]
    return t_s, np.array([[r.getQ1(), r.getQ2(), r.getQ3(), r.getQ0()] for r in rotations])


@pytest.mark.parametrize("scale", (*SCALES, "TDB"))
@pytest.mark.parametrize("form", FORMATS)
def test_comes_back_by_import(attitude, tmp_path, form, scale):
    run("--quiet", "import", exported(attitude, tmp_path, form, scale), "-o", tmp_path / "back.csv")
    t_ns, q = read_attitude(tmp_path / "back.csv")
    assert (t_ns == attitude.t_ns).all()
    assert np.abs(q - attitude.q).max() <= 1e-15


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("form", FORMATS)
def test_orekit_reads_every_epoch_and_quaternion(attitude, tmp_path, form, scale):
    aem = orekit_parser().parseMessage(DataSource(str(exported(attitude, tmp_path, form, scale))))
    t_s, q = states_of_orekit(aem)
    assert len(aem.getSegments()) == len(attitude.stretches)
    # durationFrom gives a double: 200 s are known to 2.8e-14 s.
    assert (np.rint(t_s * 1e9) == attitude.t_ns).all() and np.abs(t_s - attitude.t_ns * 1e-9).max() <= 3e-14
    assert np.abs(q - attitude.q).max() <= 1e-15


def test_orekit_turns_vectors_as_we_do(attitude, tmp_path):
    """Components in c of the inertial x axis: q* x q."""
    from org.hipparchus.geometry.euclidean.threed import Vector3D
    aem = orekit_parser().parseMessage(DataSource(str(exported(attitude, tmp_path, "aem", "TAI"))))
    state = aem.getSegments().get(0).getData().getAngularCoordinates().get(100)
    x, y, z, w = attitude.q[100]
    expected = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]  # first row of C_in_c
    turned = state.getRotation().applyTo(Vector3D.PLUS_I)
    assert np.abs(np.array([turned.getX(), turned.getY(), turned.getZ()]) - expected).max() <= 1e-15


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("form", FORMATS)
def test_what_orekit_writes_is_read(attitude, tmp_path, form, scale):
    aem = orekit_parser().parseMessage(DataSource(str(exported(attitude, tmp_path, form, scale))))
    text = StringBuilder()
    generator = (KvnGenerator(text, 0, "a", 0.0, 0) if form == "aem" else XmlGenerator(text, 2, "a", 0.0, True, None))
    WriterBuilder().buildAemWriter().writeMessage(generator, aem)
    generator.close()
    (tmp_path / "theirs").write_text(str(text.toString()))
    run("--quiet", "import", tmp_path / "theirs", "-o", tmp_path / "back.csv", "--epoch", EPOCH)
    t_ns, q = read_attitude(tmp_path / "back.csv")
    assert (t_ns == attitude.t_ns).all()
    assert np.abs(q - attitude.q).max() <= 1e-15


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("form", FORMATS)
def test_ccsds_ndm_reads_and_writes(attitude, tmp_path, form, scale):
    path = exported(attitude, tmp_path, form, scale)
    aem = ccsds_ndm.Aem.from_file(str(path))
    aem.validate()
    states = np.concatenate([segment.data.attitude_states_numpy for segment in aem.segments])
    assert np.abs(states - attitude.q).max() <= 1e-15
    epochs = [epoch for segment in aem.segments for epoch in segment.data.attitude_states_epochs]
    assert len(epochs) == len(attitude.t_ns)
    if scale == "TAI":
        begin = datetime.datetime.fromisoformat(EPOCH)
        for epoch, t_ns in zip(epochs, attitude.t_ns):
            since = datetime.datetime.fromisoformat(epoch[:19]) - begin
            fraction = int(epoch[20:].ljust(9, "0") or 0)
            assert round(since.total_seconds()) * 10**9 + fraction == t_ns
    for theirs in ("KVN", "XML"):
        (tmp_path / theirs).write_text(aem.to_str(theirs.lower()))
        run("--quiet", "import", tmp_path / theirs, "-o", tmp_path / "back.csv", "--epoch", EPOCH)
        t_ns, q = read_attitude(tmp_path / "back.csv")
        assert (t_ns == attitude.t_ns).all()
        assert np.abs(q - attitude.q).max() <= 1e-15


@pytest.mark.parametrize("form", ("acm", "acm-xml"))
def test_peers_read_a_calibration(calibrated, calibration, tmp_path, form):
    path = tmp_path / f"calibration.{form}"
    run("--quiet", "export", calibrated / "out" / "calibration.json", "--format", form, "-o", path, "--pass", calibrated / "pass",
        "--attitude", calibrated / "out" / "attitude.csv")
    acm = ccsds_ndm.Acm.from_file(str(path))
    acm.validate()
    orekit = ParserBuilder().buildAcmParser().parseMessage(DataSource(str(path)))
    data = orekit.getSegments().get(0).getData()
    states = data.getAttitudeBlocks().get(0).getAttitudeStates()
    _, q = read_attitude(calibrated / "out" / "attitude.csv")
    assert states.size() == len(q)
    got = np.array([[float(value) for value in state.getElements()] for state in states])
    assert np.abs(got[:, :4] - q).max() <= 1e-15
    assert str(data.getAttitudeBlocks().get(0).getMetadata().getRateType().name()) == "GYRO_BIAS"
    drift = [np.linalg.norm(list(gyro["drift_rad_s"].values())) for gyro in calibration["gyros"]]
    assert 0 < np.linalg.norm(got[:, 4:], axis=1).max() < 3 * max(drift)  # rad/s, as Orekit holds it
    determination = data.getAttitudeDeterminationBlock()
    assert str(determination.getMethod()) == "EKF"
    if form == "acm":
        assert [str(determination.getSensorsUsed().get(i).getSensorUsed()) for i in range(3)] == ["AST", "GYRO", "GYRO"]
    turned = data.getManeuverBlocks()
    assert turned is None or turned.isEmpty()  # four minutes without a slew
    user = {str(key): str(data.getUserDefinedBlock().getParameters().get(key))
            for key in data.getUserDefinedBlock().getParameters().keySet()}
    for index, gyro in enumerate(calibration["gyros"], start=1):
        for name, value in gyro["drift_rad_s"].items():
            assert abs(float(user[f"TRIHEDRON_GYRO{index}_{name.upper()}_RAD_S"]) - value) <= 1e-15 * abs(value)
    assert user["TRIHEDRON_VERDICT"] == ("TRUSTWORTHY" if calibration["verdict"]["trustworthy"] else "DO NOT USE")
    assert (tmp_path / user["TRIHEDRON_COVARIANCE_FILE"]).exists()


@pytest.mark.parametrize("form", ("acm", "acm-xml"))
def test_peers_read_slews_as_manoeuvres(calibrated, tmp_path, form):
    """A turn of 20° about x in 40 s, from 100 s on."""
    rows = []
    for i in range(81):
        half = 0.175 * min(max((3 * i - 100) / 40, 0), 1)
        rows.append(f"{3 * i},{np.sin(half):.17g},0,0,{np.cos(half):.17g}")
    (tmp_path / "turned.csv").write_text("t_s,q_x,q_y,q_z,q_w\n" + "\n".join(rows) + "\n")
    path = tmp_path / f"slews.{form}"
    run("--quiet", "export", calibrated / "out" / "calibration.json", "--format", form, "-o", path, "--attitude", tmp_path / "turned.csv")
    ccsds_ndm.Acm.from_file(str(path)).validate()
    data = ParserBuilder().buildAcmParser().parseMessage(DataSource(str(path))).getSegments().get(0).getData()
    assert data.getManeuverBlocks().size() == 1
    slew = data.getManeuverBlocks().get(0)
    assert (slew.getBeginTime(), slew.getEndTime()) == (99, 141)
    q = slew.getTargetAttitude()
    assert abs(q.getQ1() - np.sin(0.175)) < 1e-15 and abs(abs(q.getQ0()) - np.cos(0.175)) < 1e-15
    assert "1 manoeuvre" in run("import", path, "-o", tmp_path / "back.json")


@pytest.fixture(scope="module")
def earth():
    """The centre of an OEM, of which Orekit asks little, and for which it would want an ephemeris of the planets."""
    import jpype
    body = jpype.JProxy("org.orekit.bodies.CelestialBody", dict={"getName": lambda: "Earth", "getGM": lambda: 3.986004418e14})
    loader = jpype.JProxy("org.orekit.bodies.CelestialBodyLoader", dict={"loadCelestialBody": lambda name: body})
    DataContext.getDefault().getCelestialBodies().addCelestialBodyLoader("Earth", loader)


def ellipse(t_s):
    """Position and velocity, km and km/s, of Kepler's motion on an inclined ellipse."""
    a, e, rate = 6860.0, 0.018, np.sqrt(398600.4418 / 6860.0**3)
    anomaly = mean = rate * t_s + 0.3
    for _ in range(30):
        anomaly = mean + e * np.sin(anomaly)
    c, s, minor = np.cos(anomaly), np.sin(anomaly), np.sqrt(1 - e * e)
    p, q = np.array([0.6, 0.48, 0.64]), np.array([-0.8, 0.36, 0.48])
    return a * ((c - e) * p + minor * s * q), a * rate / (1 - e * c) * (minor * c * q - s * p)


@pytest.mark.parametrize("method", (("HERMITE", 7), ("LAGRANGE", 9), None))
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("form", ("kvn", "xml"))
def test_an_orbit_that_orekit_writes_is_flown_as_orekit_interpolates_it(earth, tmp_path, form, scale, method):
    minutes = [f"2008-12-31T{23 + (50 + i) // 60:02d}:{(50 + i) % 60:02d}:00" if i < 10 else f"2009-01-01T00:{i - 10:02d}:00" for i in range(21)]
    ours = ["CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2026-01-02T03:04:05", "ORIGINATOR = TEST", "META_START", "OBJECT_NAME = TEST",
            "OBJECT_ID = 2026-001A", "CENTER_NAME = EARTH", "REF_FRAME = EME2000", f"TIME_SYSTEM = {scale}", f"START_TIME = {minutes[0]}",
            f"STOP_TIME = {minutes[-1]}", *([f"INTERPOLATION = {method[0]}", f"INTERPOLATION_DEGREE = {method[1]}"] if method else []), "META_STOP"]
    parser = ParserBuilder().buildOemParser()
    epoch = AbsoluteDate(EPOCH, TimeScalesFactory.getTAI())
    scales = {"TAI": TimeScalesFactory.getTAI, "UTC": TimeScalesFactory.getUTC, "GPS": TimeScalesFactory.getGPS, "TT": TimeScalesFactory.getTT}
    for minute in minutes:
        position, velocity = ellipse(AbsoluteDate(minute, scales[scale]()).durationFrom(epoch))
        ours.append(" ".join([minute, *(f"{value:.12f}" for value in (*position, *velocity))]))
    (tmp_path / "ours.oem").write_text("\n".join(ours) + "\n")
    oem = parser.parseMessage(DataSource(str(tmp_path / "ours.oem")))
    text = StringBuilder()
    generator = KvnGenerator(text, 0, "a", 0.0, 0) if form == "kvn" else XmlGenerator(text, 2, "a", 0.0, True, None)
    WriterBuilder().buildOemWriter().writeMessage(generator, oem)
    generator.close()
    (tmp_path / "theirs.oem").write_text(str(text.toString()))
    (tmp_path / "scenario.toml").write_text(
        f'[scenario]\nepoch_tai = "{EPOCH}"\nduration = "4min"\n[gyro]\nperiod = "1s"\n[orbit]\nephemeris = "theirs.oem"\n'
        '[attitude]\nslews = "none"\njitter = "0arcsec"\n')
    run("--quiet", "simulate", tmp_path / "scenario.toml", "-o", tmp_path / "pass")
    t_ns, q = read_attitude(tmp_path / "pass" / "truth.csv")
    propagator = oem.getSegments().get(0).getPropagator() if method else None
    for t_s, (x, y, z, w) in zip(t_ns * 1e-9, q):
        if propagator is None:
            position, velocity = ellipse(t_s)
        else:
            pv = propagator.propagate(epoch.shiftedBy(float(t_s))).getPVCoordinates()
            position = np.array([pv.getPosition().getX(), pv.getPosition().getY(), pv.getPosition().getZ()])
            velocity = np.array([pv.getVelocity().getX(), pv.getVelocity().getY(), pv.getVelocity().getZ()])
        normal = np.cross(position, velocity)
        c_y = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)]
        c_z = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        # Truth has twelve decimals. Orekit interpolates velocity with position, so of Lagrange's it is another polynomial.
        assert np.linalg.norm(np.cross(c_z, position / np.linalg.norm(position))) < 1e-10
        assert np.linalg.norm(np.cross(c_y, normal / np.linalg.norm(normal))) < 1e-9


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("form", ("apm", "apm-xml"))
def test_peers_read_and_write_an_attitude_of_one_epoch(attitude, tmp_path, form, scale):
    rates = np.array([1e-3, -2e-3, 0.1]) / 3
    rated = tmp_path / "rated.csv"
    row = 100
    rated.write_text("t_s,q_x,q_y,q_z,q_w,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s\n" + ",".join(
        [f"{attitude.t_ns[row] / 1e9:.9f}", *(f"{value:.17g}" for value in (*attitude.q[row], *rates))]) + "\n")
    path = tmp_path / f"a.{form}"
    run("--quiet", "export", rated, "--format", form, "-o", path, "--epoch", EPOCH, "--time-system", scale, "--object-id", "2006-021A")
    theirs = ccsds_ndm.Apm.from_file(str(path))
    theirs.validate()
    orekit = ParserBuilder().buildApmParser().parseMessage(DataSource(str(path)))
    data = orekit.getSegments().get(0).getData()
    epoch = AbsoluteDate(EPOCH, TimeScalesFactory.getTAI())
    assert round(data.getEpoch().durationFrom(epoch) * 1e9) == attitude.t_ns[row]
    q = data.getQuaternionBlock().getQuaternion()
    assert np.abs(np.array([q.getQ1(), q.getQ2(), q.getQ3(), q.getQ0()]) - attitude.q[row]).max() <= 1e-15
    velocity = data.getAngularVelocityBlock()
    got = np.array([velocity.getAngVelX(), velocity.getAngVelY(), velocity.getAngVelZ()])
    assert np.abs(got - rates).max() <= 1e-16
    text = StringBuilder()
    generator = KvnGenerator(text, 0, "a", 0.0, 0) if form == "apm" else XmlGenerator(text, 2, "a", 0.0, True, None)
    WriterBuilder().buildApmWriter().writeMessage(generator, orekit)
    generator.close()
    for written in (theirs.to_str("kvn"), theirs.to_str("xml"), str(text.toString())):
        (tmp_path / "theirs").write_text(written)
        run("--quiet", "import", tmp_path / "theirs", "-o", tmp_path / "back.csv", "--epoch", EPOCH)
        t_ns, back = read_attitude(tmp_path / "back.csv")
        assert t_ns == [attitude.t_ns[row]] and np.abs(back - attitude.q[row]).max() <= 1e-15
