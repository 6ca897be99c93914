"""Repairs the checksums of an HDF5 file whose metadata were changed, so that the change is read and not only noticed.

Of the superblock (version 2 and 3) and the object headers (version 2) with their continuations, where groups, dimensions, types and
attributes stand. HDF5 File Format Specification, II.A and IV.A.1.b; the checksum is lookup3 of B. Jenkins, hashlittle().
"""
MASK = 0xFFFFFFFF
CONTINUATION = 0x10


def rotated(x, bits):
    return ((x << bits) | (x >> (32 - bits))) & MASK


def lookup3(data):
    a = b = c = (0xDEADBEEF + len(data)) & MASK
    at = 0
    while len(data) - at > 12:
        a = (a + int.from_bytes(data[at:at + 4], "little")) & MASK
        b = (b + int.from_bytes(data[at + 4:at + 8], "little")) & MASK
        c = (c + int.from_bytes(data[at + 8:at + 12], "little")) & MASK
        a = ((a - c) & MASK) ^ rotated(c, 4)
        c = (c + b) & MASK
        b = ((b - a) & MASK) ^ rotated(a, 6)
        a = (a + c) & MASK
        c = ((c - b) & MASK) ^ rotated(b, 8)
        b = (b + a) & MASK
        a = ((a - c) & MASK) ^ rotated(c, 16)
        c = (c + b) & MASK
        b = ((b - a) & MASK) ^ rotated(a, 19)
        a = (a + c) & MASK
        c = ((c - b) & MASK) ^ rotated(b, 4)
        b = (b + a) & MASK
        at += 12
    rest = data[at:]
    if not rest:
        return c
    rest = rest + bytes(12 - len(rest))
    a = (a + int.from_bytes(rest[0:4], "little")) & MASK
    b = (b + int.from_bytes(rest[4:8], "little")) & MASK
    c = (c + int.from_bytes(rest[8:12], "little")) & MASK
    for x, y, bits in (("c", "b", 14), ("a", "c", 11), ("b", "a", 25), ("c", "b", 16), ("a", "c", 4), ("b", "a", 14), ("c", "b", 24)):
        value = {"a": a, "b": b, "c": c}
        value[x] = ((value[x] ^ value[y]) - rotated(value[y], bits)) & MASK
        a, b, c = value["a"], value["b"], value["c"]
    return c


def messages(content, begin, end, flags):
    """Type and place of the data of each message between."""
    head = 6 if flags & 4 else 4
    while begin + head <= end:
        size = int.from_bytes(content[begin + 1:begin + 3], "little")
        yield content[begin], begin + head
        begin += head + size


def blocks(content):
    """Begin and end of each block that a checksum follows, as the file was written."""
    found = [(0, 44)]
    at = content.find(b"OHDR")
    while at >= 0:
        flags = content[at + 5]
        begin = at + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        first = begin + width
        end = first + int.from_bytes(content[begin:first], "little")
        found.append((at, end))
        pending = [(first, end)]
        while pending:
            for kind, data in messages(content, *pending.pop(), flags):
                if kind == CONTINUATION:
                    offset = int.from_bytes(content[data:data + 8], "little")
                    after = offset + int.from_bytes(content[data + 8:data + 16], "little") - 4
                    found.append((offset, after))
                    pending.append((offset + 4, after))
        at = content.find(b"OHDR", at + 4)
    return found


def repaired(original, spoilt):
    """`spoilt`, of the same length as `original`, with the checksums that fit its blocks."""
    result = bytearray(spoilt)
    for begin, end in blocks(original):
        result[end:end + 4] = lookup3(bytes(result[begin:end])).to_bytes(4, "little")
    return bytes(result)
