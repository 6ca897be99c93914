"""Ways to spoil the bytes of a file. Each takes a random.Random and the content, and returns other content; none knows the program."""
import re

EXTREMES = ["0", "-0", "-0.0", "1", "-1", "2", "nan", "-nan", "inf", "-inf", "1e308", "-1e308", "1.7976931348623157e308", "1e309", "5e-324",
            "1e-308", "1e-30", "1e30", "1e100", "1e10", "1e9", "1e15", "9223372036854775807", "-9223372036854775808", "18446744073709551616",
            "4294967296", "2147483648", "0x10", "1_000", "007", "1e", ".", "-", "+1", "1,5", "true", "\"1\"", "[]", "{}", "",
            "1" * 400, "0." + "3" * 5000]
INSERTIONS = [b"\0", b"\r", b"\r\n", b"\n", b"\xff", b"\xef\xbb\xbf", b"\x1b[31m", b"\xe2\x80\xae", b"\xed\xa0\x80", b"\"", b"'", b"'''",
              b"\"\"\"", b"\\", b"\\u0000", b"\\ud800", b",", b";", b"#", b"=", b"[", b"]", b"{", b"}", b"[[", b"]]", b"../", b"/dev/zero",
              b"%s%n", b"<script>", b"A" * 70_000, b"[" * 50_000, b"{\"a\":" * 50_000, b"a." * 20_000, b"," * 20_000, b"\n" * 20_000]
NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TOKEN = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*|[-+]?\d[\d.eE+-]*|\S")


def place(rng, content):
    return rng.randrange(len(content) + 1)


def stretch(rng, content, most=200):
    begin = place(rng, content)
    return begin, min(len(content), begin + rng.randint(1, most))


# Of bytes.


def flip_bits(rng, content):
    spoilt = bytearray(content)
    for _ in range(rng.choice([1, 1, 1, 2, 8, 64]) if spoilt else 0):
        spoilt[rng.randrange(len(spoilt))] ^= 1 << rng.randrange(8)
    return bytes(spoilt)


def set_bytes(rng, content):
    spoilt = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 16]) if spoilt else 0):
        spoilt[rng.randrange(len(spoilt))] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
    return bytes(spoilt)


def overwrite_integer(rng, content):
    size = rng.choice([2, 4, 8])
    value = rng.choice([0, 1, (1 << (8 * size - 1)) - 1, 1 << (8 * size - 1), (1 << 8 * size) - 1, rng.randrange(1 << 8 * size)])
    at = place(rng, content)
    return content[:at] + value.to_bytes(size, rng.choice(["little", "big"])) + content[at + size:]


def truncate(rng, content):
    return content[:place(rng, content)]


def drop_stretch(rng, content):
    begin, end = stretch(rng, content)
    return content[:begin] + content[end:]


def repeat_stretch(rng, content):
    begin, end = stretch(rng, content)
    return content[:end] + content[begin:end] * rng.choice([1, 2, 50]) + content[end:]


def zero_stretch(rng, content):
    begin, end = stretch(rng, content, 4096)
    return content[:begin] + bytes(end - begin) + content[end:]


def insert(rng, content):
    at = place(rng, content)
    return content[:at] + rng.choice(INSERTIONS) + content[at:]


def insert_noise(rng, content):
    at = place(rng, content)
    return content[:at] + rng.randbytes(rng.randint(1, 40)) + content[at:]


def append(rng, content):
    return content + rng.choice([rng.choice(INSERTIONS), content, rng.randbytes(100)])


# Of lines.


def with_lines(edit):
    def mutate(rng, content):
        lines = content.splitlines(keepends=True)
        if lines:
            edit(rng, lines)
        return b"".join(lines)
    mutate.__name__ = edit.__name__
    return mutate


@with_lines
def drop_line(rng, lines):
    del lines[rng.randrange(len(lines))]


@with_lines
def drop_many_lines(rng, lines):
    begin = rng.randrange(len(lines))
    del lines[begin:begin + rng.randint(2, 60)]


@with_lines
def repeat_line(rng, lines):
    at = rng.randrange(len(lines))
    lines[at:at] = [lines[at]] * rng.choice([1, 2, 1000])


@with_lines
def swap_lines(rng, lines):
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]


@with_lines
def shuffle_lines(rng, lines):
    rng.shuffle(lines)


@with_lines
def join_lines(rng, lines):
    at = rng.randrange(len(lines))
    lines[at] = lines[at].rstrip(b"\n")


# Of tokens and numbers.


def with_tokens(pattern, replacement):
    def mutate(rng, content):
        found = list(pattern.finditer(content))
        if not found:
            return content
        for match in sorted(rng.sample(found, min(len(found), rng.choice([1, 1, 1, 2, 5]))), key=lambda m: -m.start()):
            content = content[:match.start()] + replacement(rng, match.group(), found) + content[match.end():]
        return content
    mutate.__name__ = replacement.__name__
    return mutate


def extreme_number(rng, _, __):
    return rng.choice(EXTREMES).encode()


def scaled_number(rng, number, _):
    return repr(float(number) * rng.choice([-1, 1e-12, 1e-6, 1e-3, 0.5, 1.001, 2, 10, 1e3, 1e6, 1e12])).encode()


def other_token(rng, _, tokens):
    return rng.choice(tokens).group()


def no_token(_, __, ___):
    return b""


def token_twice(rng, token, _):
    return token * rng.choice([2, 2, 100])


def spoil_column(rng, content):
    """One value in the same column of many lines."""
    lines = content.split(b"\n")
    width = max(1, len(lines[0].split(b",")))
    column = rng.randrange(width)
    value = rng.choice(EXTREMES + ["0.5", "0.577350269"]).encode()
    begin = rng.choice([1, 1, rng.randrange(len(lines))])
    for i in range(begin, min(len(lines), begin + rng.choice([20, 1_000_000]))):
        fields = lines[i].split(b",")
        if column < len(fields):
            fields[column] = value
            lines[i] = b",".join(fields)
    return b"\n".join(lines)


BYTES = [flip_bits, set_bytes, overwrite_integer, truncate, drop_stretch, repeat_stretch, zero_stretch, insert, insert_noise, append]
LINES = [drop_line, drop_many_lines, repeat_line, swap_lines, shuffle_lines, join_lines]
NUMBERS = [with_tokens(NUMBER, extreme_number), with_tokens(NUMBER, scaled_number)]
TOKENS = [with_tokens(TOKEN, replacement) for replacement in (other_token, no_token, token_twice)]
TEXT = BYTES + 2 * LINES + 4 * NUMBERS + 2 * TOKENS
TABLE = TEXT + 4 * [spoil_column]


def spoilt(rng, content, mutators):
    """By one mutator, or a few, one after the other; other than it was."""
    result = content
    while result == content:
        for _ in range(rng.choice([1, 1, 1, 2, 4])):
            result = rng.choice(mutators)(rng, result)
    return result
