"""SPICE kernels, read by CSPICE."""
import numpy as np
import pytest
import spiceypy
from conftest import EPOCH, read_attitude, run

ID = -28380
# The constants of NAIF's leap second kernels, and the leap second that matters here.
LEAP_SECONDS = """KPL/LSK
\\begindata
DELTET/DELTA_T_A = 32.184
DELTET/K = 1.657D-3
DELTET/EB = 1.671D-2
DELTET/M = ( 6.239996D0 1.99096871D-7 )
DELTET/DELTA_AT = ( 33, @2006-JAN-1  34, @2009-JAN-1 )
\\begintext
"""


def matrix(q):
    """C_in_c of q_in_c, scalar last."""
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def interpolated(attitude, t_ns):
    """Turning evenly from one epoch to the next."""
    i = np.searchsorted(attitude.t_ns, t_ns, side="right") - 1
    part = (t_ns - attitude.t_ns[i]) / (attitude.t_ns[i + 1] - attitude.t_ns[i])
    a, b = attitude.q[i], attitude.q[i + 1]
    b = b if a @ b >= 0 else -b
    angle = 2 * np.arcsin(np.linalg.norm(b - a) / 2)
    return (np.sin((1 - part) * angle) * a + np.sin(part * angle) * b) / np.sin(angle)


def angle_between(a, b):
    """Of small ones: the antisymmetric part."""
    d = a @ b.T
    return np.linalg.norm([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]]) / 2


@pytest.fixture(scope="module")
def kernels(attitude, tmp_path_factory):
    directory = tmp_path_factory.mktemp("kernels")
    (directory / "leap.tls").write_text(LEAP_SECONDS)
    run("--quiet", "export", attitude.path, "--format", "ck", "-o", directory / "a.bc", "--epoch", EPOCH, "--naif-id", ID,
        "--object-name", "RESURS-DK1")
    spiceypy.kclear()
    for name in ("leap.tls", "a.tsc", "a.tf", "a.bc"):
        spiceypy.furnsh(str(directory / name))
    yield directory
    spiceypy.kclear()


@pytest.fixture
def zero_ticks(kernels, attitude):
    """Ticks of t_s = 0, by the first record."""
    return spiceypy.wnfetd(spiceypy.ckcov(str(kernels / "a.bc"), ID * 1000, False, "INTERVAL", 0.0, "SCLK"), 0)[0] - attitude.t_ns[0]


def test_intervals_are_the_stretches_without_a_gap(kernels, attitude, zero_ticks):
    cover = spiceypy.ckcov(str(kernels / "a.bc"), ID * 1000, True, "INTERVAL", 0.0, "SCLK")
    intervals = [spiceypy.wnfetd(cover, i) for i in range(spiceypy.wncard(cover))]
    assert intervals == [(begin + zero_ticks, end + zero_ticks) for begin, end in attitude.stretches]


def test_pointing_at_random_epochs(kernels, attitude, zero_ticks):
    generator = np.random.default_rng(2)
    lengths = np.array([end - begin for begin, end in attitude.stretches])
    worst = worst_pxform = 0
    for _ in range(1000):
        begin, end = attitude.stretches[generator.choice(len(lengths), p=lengths / lengths.sum())]
        t_ns = int(generator.integers(begin, end))
        c, rate, _ = spiceypy.ckgpav(ID * 1000, float(t_ns + zero_ticks), 0.0, "J2000")
        worst = max(worst, angle_between(c, matrix(interpolated(attitude, t_ns)).T))
        # Ephemeris time is known to 6e-8 s at most: the clock says which instant it is.
        et = spiceypy.sct2e(ID, float(t_ns + zero_ticks))
        instant = spiceypy.sce2c(ID, et) - zero_ticks
        if begin <= instant < end:
            worst_pxform = max(worst_pxform, angle_between(spiceypy.pxform("J2000", "RESURS-DK1_C", et),
                                                           matrix(interpolated(attitude, instant)).T))
    print(f"largest difference {worst:.1e} rad by ckgpav, {worst_pxform:.1e} rad by pxform")
    assert worst <= 1e-12 and worst_pxform <= 1e-12


def test_clock_counts_from_the_epoch(kernels, attitude, zero_ticks):
    """t_s = 0 is the epoch, TAI; ephemeris time is known to 6e-8 s."""
    et = spiceypy.sct2e(ID, float(zero_ticks))
    tai = spiceypy.unitim(et, "ET", "TAI")
    expected = (np.datetime64(EPOCH) - np.datetime64("2000-01-01T12:00:00")).astype(int)
    assert abs(tai - expected) <= 1.2e-7
    assert spiceypy.et2utc(et, "ISOC", 3) == "2008-12-31T23:57:27.000"


def test_no_pointing_in_a_gap(kernels, zero_ticks):
    with pytest.raises(spiceypy.utils.exceptions.NotFoundError):
        spiceypy.ckgp(ID * 1000, float(31 * 10**9 + zero_ticks), 0.0, "J2000")


def test_rates_turn_the_attitude(kernels, attitude, zero_ticks):
    """By half a step: the rate of the middle of three epochs, where the body's own changes by 2e-4 rad/s and noise is left out."""
    t = int(attitude.t_ns[300])
    c, rate, _ = spiceypy.ckgpav(ID * 1000, float(t + zero_ticks), 0.0, "J2000")
    before = matrix(attitude.q[299])
    after = matrix(attitude.q[301])
    turn = after @ before.T
    mean = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2 / 0.25
    assert np.linalg.norm(mean - rate) <= 1e-3 * np.linalg.norm(rate) + 1e-4


def test_gyro_frames_are_the_calibrated_alignments(calibrated, calibration, tmp_path):
    spiceypy.kclear()
    run("--quiet", "export", calibrated / "out" / "calibration.json", "--format", "fk", "-o", tmp_path / "g.tf", "--naif-id", ID,
        "--object-name", "RESURS-DK1")
    spiceypy.furnsh(str(tmp_path / "g.tf"))
    for index, gyro in enumerate(calibration["gyros"], start=1):
        vector = np.array(gyro["alignment_rotation_vector_rad"])
        expected = spiceypy.axisar(vector, np.linalg.norm(vector))
        assert angle_between(spiceypy.pxform(f"RESURS-DK1_GYRO{index}", "RESURS-DK1_C", 0.0), expected) <= 1e-15
        number = ID * 1000 - index
        assert list(spiceypy.gcpool(f"INS{number}_DRIFT_NAMES", 0, 100)) == list(gyro["drift_rad_s"])
        assert np.allclose(spiceypy.gdpool(f"INS{number}_DRIFT_RAD_S", 0, 100), list(gyro["drift_rad_s"].values()), rtol=1e-15, atol=0)
        assert np.allclose(spiceypy.gdpool(f"INS{number}_MOMENTUM_IN", 0, 3), gyro["momentum_in"], rtol=1e-15, atol=0)
    assert spiceypy.gdpool(f"INS{ID}_TRUSTWORTHY", 0, 1)[0] == calibration["verdict"]["trustworthy"]
    spiceypy.kclear()


def test_file_is_whole_for_spice(kernels):
    assert spiceypy.getfat(str(kernels / "a.bc")) == ("DAF", "CK")
    handle = spiceypy.dafopr(str(kernels / "a.bc"))
    spiceypy.dafbfs(handle)
    assert spiceypy.daffna()
    assert not spiceypy.daffna()
    spiceypy.dafcls(handle)


SCLK = """KPL/SCLK
\\begindata
SCLK_DATA_TYPE_77      = ( 1 )
SCLK01_TIME_SYSTEM_77  = ( {system} )
SCLK01_N_FIELDS_77     = ( 2 )
SCLK01_MODULI_77       = ( 4294967296 65536 )
SCLK01_OFFSETS_77      = ( 0 0 )
SCLK01_OUTPUT_DELIM_77 = ( 1 )
SCLK_PARTITION_START_77 = ( 0.0000000000000E+00 )
SCLK_PARTITION_END_77   = ( 2.8147497671065E+14 )
SCLK01_COEFFICIENTS_77 = ( 0.0 284000000.0 1.0
                           65536000000.0  285000000.25 1.0000001D0 )
\\begintext
"""


@pytest.mark.parametrize("system", (1, 2), ids=("TDB", "TDT"))
@pytest.mark.parametrize("form", (1, 3))
def test_what_cspice_writes_is_read(tmp_path, form, system):
    """Attitudes of a clock that runs at two rates, with angular velocities, in two segments of the kernel."""
    generator = np.random.default_rng(4)
    (tmp_path / "leap.tls").write_text(LEAP_SECONDS)
    (tmp_path / "a.tsc").write_text(SCLK.format(system=system))
    spiceypy.kclear()
    for name in ("leap.tls", "a.tsc"):
        spiceypy.furnsh(str(tmp_path / name))
    ticks = np.sort(generator.choice(4 * 10**6, 260, replace=False)) * 16384.0 + 65534000000.0
    quaternions = generator.standard_normal((260, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    rates = 1e-3 * generator.standard_normal((260, 3))
    handle = spiceypy.ckopn(str(tmp_path / "a.bc"), "test", 0)
    for part in (slice(0, 101), slice(101, 260)):
        t = ticks[part]
        if form == 1:
            spiceypy.ckw01(handle, t[0], t[-1], -77000, "J2000", True, "part", len(t), t, quaternions[part], rates[part])
        else:
            spiceypy.ckw03(handle, t[0], t[-1], -77000, "J2000", True, "part", len(t), t, quaternions[part], rates[part], 2, [t[0], t[50]])
    spiceypy.ckcls(handle)
    run("--quiet", "import", tmp_path / "a.bc", "-o", tmp_path / "a.csv", "--epoch", "2009-01-01T00:00:00")
    t_ns, q = read_attitude(tmp_path / "a.csv")
    et = np.array([spiceypy.sct2e(-77, tick) for tick in ticks])
    tdt = np.array([spiceypy.unitim(value, "TDB", "TDT") for value in et])
    ours = t_ns * 1e-9 + (3288 - 0.5) * 86400 + 32.184  # TT of 2009-01-01T00:00:00 TAI since J2000
    # Ephemeris time is a double of 6e-8 s; TDB of CSPICE is a shorter series than ours.
    assert np.abs(ours - tdt).max() < (2e-7 if system == 2 else 6e-5)
    assert np.abs(np.abs((q * (quaternions[:, [1, 2, 3, 0]] * [-1, -1, -1, 1])).sum(axis=1)) - 1).max() < 1e-14
    spiceypy.kclear()
