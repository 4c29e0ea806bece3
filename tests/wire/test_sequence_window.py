"""Sequence numbers: losses are counted once, late datagrams are welcome once."""

from hypothesis import given
from hypothesis import strategies as st

from rhot_node.wire.codec import SequenceVerdict, SequenceWindow


def feed(window: SequenceWindow, sequence: int) -> SequenceVerdict:
    verdict = window.judge(sequence)
    if verdict in (SequenceVerdict.FRESH, SequenceVerdict.LATE):
        window.take(sequence)
    return verdict


def test_gap_then_late_then_duplicate() -> None:
    window = SequenceWindow()
    assert [feed(window, k) for k in (5, 6, 9, 8, 8, 9, 7)] == [
        SequenceVerdict.FRESH, SequenceVerdict.FRESH, SequenceVerdict.FRESH, SequenceVerdict.LATE,
        SequenceVerdict.DUPLICATE, SequenceVerdict.DUPLICATE, SequenceVerdict.LATE]
    assert window.lost == 0


def test_old_and_far_ahead_are_refused_without_trace() -> None:
    window = SequenceWindow(size=16, longest_jump=1000)
    for k in range(100):
        feed(window, k)
    assert feed(window, 99 - 16) is SequenceVerdict.STALE
    assert feed(window, 99 + 1001) is SequenceVerdict.JUMP
    assert feed(window, 100) is SequenceVerdict.FRESH
    assert window.lost == 0


def test_restart_keeps_the_count_of_losses() -> None:
    window = SequenceWindow()
    feed(window, 0)
    feed(window, 4)
    window.restart()
    assert feed(window, 0) is SequenceVerdict.FRESH
    assert window.lost == 3


@given(st.lists(st.integers(0, 300), min_size=1, max_size=200))
def test_agrees_with_a_set(numbers: list[int]) -> None:
    window = SequenceWindow(size=1000)
    seen: set[int] = set()
    for k in numbers:
        verdict = feed(window, k)
        if k in seen or (seen and k < numbers[0]):  # numbers before the first one count as had
            assert verdict is SequenceVerdict.DUPLICATE
        else:
            assert verdict is (SequenceVerdict.FRESH if not seen or k > max(seen) else SequenceVerdict.LATE)
            seen.add(k)
    assert window.lost == max(seen) - min(seen) + 1 - len(seen)
