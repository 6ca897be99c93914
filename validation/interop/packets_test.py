"""Space packets and their XTCE, with space_packet_parser and spacepackets as peers."""
import json
import struct

import numpy as np
import orekit_jpype
import pytest
from conftest import run
from space_packet_parser.generators import ccsds_generator
from space_packet_parser.xtce.definitions import XtcePacketDefinition
from space_packet_parser.xtce.validation import validate_xtce
from spacepackets.ccsds.spacepacket import PacketType, SequenceFlags
from spacepackets.ecss.tm import InvalidTmCrc16Error, PusTm

orekit_jpype.initVM()
from org.orekit.data import DataContext  # noqa: E402
from org.orekit.time import AbsoluteDate  # noqa: E402

SCENARIO = """[scenario]
seed = 7
duration = "4min"
[gyro]
period = "125ms"
[star_tracker]
dropout_probability = 0.05
[[star_tracker.further]]
mounting_rotation_vector = ["0deg", "60deg", "0deg"]
alignment_prior_sigma = "1arcmin"
"""
TAI_OF_EPOCH_S = 1621468800  # 2009-05-20T00:00:00 since 1958-01-01
TABLES = {100: "gyro", 101: "star_tracker", 102: "star_tracker_2"}
COLUMNS = {100: ("H1_X", "H1_Y", "H1_Z", "H2_X", "H2_Y", "H2_Z"), 101: ("ST1_Q_X", "ST1_Q_Y", "ST1_Q_Z", "ST1_Q_W"),
           102: ("ST2_Q_X", "ST2_Q_Y", "ST2_Q_Z", "ST2_Q_W")}
P_FIELD = b"\x9f\x04"
TIME_OCTETS = 10


def read_table(path):
    """Times in units of 2^-32 s since 1958, as CUC has them, and values."""
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    cuc = []
    for row in rows:
        whole, _, fraction = row[0].partition(".")
        cuc.append((TAI_OF_EPOCH_S + int(whole) << 32) + round(int(fraction.ljust(9, "0")) * 2**32 / 10**9))
    return cuc, [[float(value) for value in row[1:]] for row in rows]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    directory = tmp_path_factory.mktemp("packets")
    (directory / "scenario.toml").write_text(SCENARIO)
    run("--quiet", "simulate", directory / "scenario.toml", "-o", directory / "pass")
    run("--quiet", "export", directory / "pass", "--format", "packets", "-o", directory / "telemetry.ccsds")
    return directory


def octets_of_packets(path):
    with path.open("rb") as file:
        return [bytes(packet) for packet in ccsds_generator(file)]


def test_the_xtce_keeps_to_its_schema(flown):
    result = validate_xtce(flown / "telemetry.xtce.xml", level="all")
    assert result.valid, str(result)
    assert result.schema_location.endswith("20180204/SpaceSystem.xsd")  # version 1.2


def test_space_packet_parser_decodes_the_same_numbers_by_the_xtce(flown):
    definition = XtcePacketDefinition.from_xtce(flown / "telemetry.xtce.xml")
    times, values = {apid: [] for apid in TABLES}, {apid: [] for apid in TABLES}
    for octets in octets_of_packets(flown / "telemetry.ccsds"):
        packet = definition.parse_bytes(octets)
        apid = packet["APID"]
        assert (packet["SERVICE_TYPE"], packet["MESSAGE_SUBTYPE"], packet["PUS_VERSION"]) == (3, 25, 2)
        assert packet["TIME"] == pytest.approx(packet["TIME"].raw_value / 2**32, abs=2.4e-7)  # a double of 1.6e9 s
        times[apid].append(packet["TIME"].raw_value)
        values[apid].append([packet[name] for name in COLUMNS[apid]])
        valid = [value.raw_value for name, value in packet.items() if name.endswith("_VALID")]
        assert valid == ([1, 1] if apid == 100 else [1])
    for apid, name in TABLES.items():
        expected_times, expected_values = read_table(flown / "pass" / f"{name}.csv")
        assert times[apid] == expected_times
        assert np.array_equal(values[apid], expected_values)


def test_spacepackets_finds_headers_and_crc_right(flown):
    counts = {apid: 0 for apid in TABLES}
    for octets in octets_of_packets(flown / "telemetry.ccsds"):
        packet = PusTm.unpack(octets, TIME_OCTETS)  # checks the CRC
        assert (packet.service, packet.message_subtype) == (3, 25)
        assert packet.space_packet_header.packet_type == PacketType.TM
        assert packet.space_packet_header.seq_flags == SequenceFlags.UNSEGMENTED
        assert packet.seq_count == counts[packet.apid] % 16384
        assert packet.pus_tm_sec_header.message_counter == counts[packet.apid]
        assert packet.timestamp[:2] == P_FIELD
        counts[packet.apid] += 1
    assert counts[100] == 1921
    broken = bytearray(octets)
    broken[30] ^= 4
    with pytest.raises(InvalidTmCrc16Error):
        PusTm.unpack(bytes(broken), TIME_OCTETS)


def test_orekit_reads_the_time_code_by_its_p_field(flown):
    tai = DataContext.getDefault().getTimeScales().getTAI()
    since = AbsoluteDate("1958-01-01T00:00:00", tai)
    times = {apid: [] for apid in TABLES}
    packets = octets_of_packets(flown / "telemetry.ccsds")
    for octets in packets[:200]:
        signed = [octet - 256 if octet > 127 else octet for octet in octets[13:23]]
        date = AbsoluteDate.parseCCSDSUnsegmentedTimeCode(signed[0], signed[1], signed[2:], None, since)
        times[PusTm.unpack(octets, TIME_OCTETS).apid].append(date.durationFrom(since))
    for apid, name in TABLES.items():
        expected = [cuc / 2**32 for cuc in read_table(flown / "pass" / f"{name}.csv")[0][:len(times[apid])]]
        assert times[apid] == pytest.approx(expected, rel=0, abs=2.4e-7)


def made(apid, count, structure, cuc, valid, numbers):
    """By spacepackets. The time reference status and the destination are those of another mission."""
    per_reading = len(numbers) // valid
    data = struct.pack(">H", structure)
    for i in range(valid):
        data += struct.pack(f">B{per_reading}d", 1, *numbers[i * per_reading:(i + 1) * per_reading])
    packet = PusTm(service=3, message_subtype=25, timestamp=P_FIELD + struct.pack(">Q", cuc), source_data=data, apid=apid,
                   seq_count=count % 16384, message_counter=count % 65536, destination_id=7)
    return bytes(packet.pack())


def test_packets_of_spacepackets_are_read(flown, tmp_path):
    packets = []
    for apid, name in TABLES.items():
        readings = 2 if apid == 100 else 1
        for count, (cuc, numbers) in enumerate(zip(*read_table(flown / "pass" / f"{name}.csv"))):
            # Counts wrap around on the way.
            packets.append((cuc, made(apid + 500, 16000 + count, 2 if apid == 100 else 1, cuc, readings, numbers)))
    packets.sort(key=lambda packet: packet[0])
    (tmp_path / "others.ccsds").write_bytes(b"".join(octets for _, octets in packets))
    toml = (flown / "telemetry.toml").read_text().replace("apid = 100", "apid = 600")
    (tmp_path / "others.toml").write_text(toml.replace("telemetry.ccsds", "others.ccsds"))
    said = json.loads(run("--json", "import", tmp_path / "others.toml", "-o", tmp_path / "back"))
    assert {defect["kind"] for defect in said["defects"]} == {"gap"}  # dropouts of the star trackers, and no packet
    for name in (*[f"{table}.csv" for table in TABLES.values()], "pass.toml"):
        assert (tmp_path / "back" / name).read_text() == (flown / "pass" / name).read_text()
