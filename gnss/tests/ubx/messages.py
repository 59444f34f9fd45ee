"""Random messages of UBX from an encoder that others wrote (PyPI: pyubx2).

    messages.py COUNT SEED STREAM EXPECTED

Writes COUNT messages to STREAM, and to EXPECTED a line for each: what was meant, as numbers.
"""

import random
import sys

from pyubx2 import GET, UBXMessage


def value(number, scale):
    """What is encoded as this number, whether the encoder rounds or cuts."""
    return (number + (0.25 if number >= 0 else -0.25)) * scale


def solution(chance):
    """NAV-PVT."""
    whole = {
        "iTOW": chance.randrange(604_800_000),
        "year": chance.randrange(1980, 2100),
        "month": chance.randrange(1, 13),
        "day": chance.randrange(1, 29),
        "hour": chance.randrange(24),
        "min": chance.randrange(60),
        "second": chance.randrange(60),
        "nano": chance.randrange(-1_000_000_000, 1_000_000_001),
        "validDate": chance.randrange(2),
        "validTime": chance.randrange(2),
        "fixType": chance.randrange(7),
        "gnssFixOk": chance.randrange(2),
        "diffSoln": chance.randrange(2),
        "carrSoln": chance.randrange(4),
        "numSV": chance.randrange(256),
        "height": chance.randrange(-(2**31), 2**31),
        "hAcc": chance.randrange(2**32),
        "gSpeed": chance.randrange(1_000_001),
    }
    latitude = chance.randrange(-900_000_000, 900_000_001)
    longitude = chance.randrange(-1_800_000_000, 1_800_000_001)
    course = chance.randrange(0, 36_000_000)
    scaled = {
        "lat": value(latitude, 1e-7),
        "lon": value(longitude, 1e-7),
        "headMot": value(course, 1e-5),
    }
    message = UBXMessage("NAV", "NAV-PVT", GET, **whole, **scaled)
    return message, ["pvt", *whole.values(), latitude, longitude, course]


def baseline(chance):
    """NAV-RELPOSNED."""
    whole = {
        "iTOW": chance.randrange(604_800_000),
        "relPosLength": chance.randrange(100_000),
        "gnssFixOK": chance.randrange(2),
        "diffSoln": chance.randrange(2),
        "relPosValid": chance.randrange(2),
        "carrSoln": chance.randrange(4),
        "relPosHeadingValid": chance.randrange(2),
    }
    heading = chance.randrange(0, 36_000_000)
    sigma = chance.randrange(0, 18_000_000)
    scaled = {"relPosHeading": value(heading, 1e-5), "accHeading": value(sigma, 1e-5)}
    message = UBXMessage("NAV", "NAV-RELPOSNED", GET, version=1, **whole, **scaled)
    return message, ["relposned", *whole.values(), heading, sigma]


def other(chance):
    """Something that is not asked for."""
    message = UBXMessage("NAV", "NAV-CLOCK", GET, iTOW=chance.randrange(1000))
    return message, ["other"]


def main():
    """Makes the files."""
    count, seed, stream, expected = sys.argv[1:]
    chance = random.Random(int(seed))
    kinds = [solution] * 10 + [baseline] * 9 + [other]
    with open(stream, "wb") as stream, open(expected, "w", encoding="ascii") as expected:
        for _ in range(int(count)):
            message, meant = chance.choice(kinds)(chance)
            stream.write(message.serialize())
            expected.write("\t".join(map(str, meant)) + "\n")


main()
