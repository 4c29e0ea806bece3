"""Tags: golden packets, the library's own one-shot hash as the oracle, and that every changed bit is noticed."""

from __future__ import annotations

import hashlib
import random

import pytest
from wire_samples import KEY, TAGGED, packet

from rhot_node.errors import WireError
from rhot_node.wire.codec import TAG_LENGTH, Seal, decode, decode_sealed, decode_verified, encode, node_of

SEAL = Seal(KEY)


def refused(data: bytes, seal: Seal = SEAL) -> str:
    with pytest.raises(WireError) as caught:
        decode_sealed(data, seal)
    return caught.value.reason


@pytest.mark.parametrize("name", TAGGED)
def test_tagged_golden_packets_byte_for_byte(name: str) -> None:
    data = packet(name)
    assert encode(TAGGED[name], SEAL) == data
    assert decode_sealed(data, SEAL) == decode_sealed(memoryview(data), SEAL) == TAGGED[name]
    assert decode_verified(data) == TAGGED[name]
    plain = packet(name.removeprefix("tagged_"))
    assert data[:6] + b"\0\0" + data[8:-TAG_LENGTH] == plain, "a tag changes one flag and is appended"
    assert data[-TAG_LENGTH:] == hashlib.blake2b(data[:-TAG_LENGTH], key=KEY, digest_size=16,
                                                 person=b"RHOT datagram 1").digest()


@pytest.mark.parametrize("name", TAGGED)
def test_every_changed_bit_and_every_truncation_is_refused(name: str) -> None:
    data = packet(name)
    for bit in range(8 * len(data)):
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        assert refused(bytes(changed)) in ("magic", "version", "flags", "untagged", "tag")
    for length in range(len(data)):
        assert refused(data[:length]) in ("length", "tag")
    assert refused(data + b"\0") == "tag"


def test_another_key_and_no_key_refuse() -> None:
    data = packet("tagged_stop")
    assert refused(data, Seal(bytes(32))) == "tag"
    assert refused(packet("stop")) == "untagged"
    with pytest.raises(WireError, match="tag"):
        decode(data)


def test_a_sound_tag_makes_nothing_plausible() -> None:
    rng = random.Random(11)
    reasons = set()
    for _ in range(3000):
        data = bytearray(packet(rng.choice(list(TAGGED)))[:-TAG_LENGTH])
        data[rng.randrange(8, len(data))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.2:
            del data[rng.randrange(24, len(data) + 1):]
        sealed = bytes(data) + SEAL.tag(data)
        try:
            message = decode_sealed(sealed, SEAL)
        except WireError as exc:
            reasons.add(exc.reason)
        else:
            assert encode(message, SEAL)[:24] == sealed[:24]
    assert {"length", "header", "marker", "reserved"} <= reasons and not {"tag", "untagged"} & reasons


def test_the_node_is_named_before_anything_is_verified() -> None:
    assert node_of(packet("tagged_clock_request")) == 2
    with pytest.raises(WireError, match="length"):
        node_of(b"RHOT")


def test_a_key_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="32 bytes"):
        Seal(b"short")
