"""``rhot trim``: a part that is tracked alike, with its bookmarks, its wall clock and its videos; nothing by halves."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path

import numpy as np
import pytest
from film_writing import write_film
from tracked_log import states_of_log

from rhot_app.__main__ import main
from rhot_app.export.trim import trim_log
from rhot_app.recording.bookmarks import Bookmark, append_bookmark, read_bookmarks
from rhot_app.recording.raw_log import LogReader
from rhot_app.recording.video import video_path
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.video.avi import read_stamps


@pytest.fixture
def recording(log: Path, tmp_path: Path) -> Path:
    """A copy with a bookmark within the part and one before it."""
    path = tmp_path / "wave.rhotlog"
    shutil.copy(log, path)
    first_ns = int(states_of_log(path).t_master_ns[0])
    for at_s, text in ((0.1, "before"), (0.8, "within")):
        append_bookmark(path, Bookmark(first_ns + round(1e9 * at_s), text))
    return path


def test_a_part_is_tracked_as_in_the_whole(recording: Path, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    part = tmp_path / "part.rhotlog"
    assert main(["trim", str(recording), "--from", "0.5", "--to", "1.2", "--out", str(part)]) == 0
    assert str(part) in capsys.readouterr().out
    whole, own = states_of_log(recording), states_of_log(part)
    first_ns = int(whole.t_master_ns[0])
    assert own.t_master_ns[0] >= first_ns + 500_000_000
    assert own.t_master_ns[-1] <= first_ns + 1_225_000_000, "a state lies within its frames, which end later"
    same, at, of = np.intersect1d(whole.t_master_ns, own.t_master_ns, return_indices=True)
    assert len(same) > 0.9 * len(own) > 20
    settled = of > 8  # a filter begins anew
    off = np.linalg.norm(whole.fingertip_positions[at][settled] - own.fingertip_positions[of][settled], axis=2)
    assert np.nanmedian(off) < 1e-3
    assert [mark.text for mark in read_bookmarks(part)] == ["within"]
    with contextlib.closing(LogReader(recording)) as old, contextlib.closing(LogReader(part)) as new:
        assert new.about["trimmed_from"] == "wave.rhotlog" and new.rig == old.rig
        assert new.about.get("created") == old.about.get("created"), "its times are of the same wall clock"
        assert not new.losses.end or list(new)  # it ends with its mark
        assert "video" not in new.about, "no node has a video of this name"


def test_the_videos_are_trimmed_alike(recording: Path, tmp_path: Path) -> None:
    with contextlib.closing(LogReader(recording)) as reader:
        door, nodes = LogValidator(reader.rig), reader.rig.nodes
        frames = [frame for record in reader if isinstance(frame := door.feed(record), CameraObservations)]
    stamps = [[frame.t_row0_node_ns for frame in frames if frame.camera == camera] for camera in range(len(nodes))]
    write_film(video_path(recording, nodes[0].name), stamps[0])
    begin_ns, end_ns = frames[0].t_row0_master_ns + 400_000_000, frames[0].t_row0_master_ns + 900_000_000
    done = trim_log(recording, tmp_path / "part.rhotlog", begin_ns, end_ns)
    wanted = [frame.t_row0_node_ns for frame in frames
              if frame.camera == 0 and begin_ns <= frame.t_row0_master_ns <= end_ns]
    assert done.videos == (video_path(done.path, nodes[0].name),)
    assert [stamp.t_node_ns for stamp in read_stamps(done.videos[0])] == wanted
    assert len(done.videos[0].with_suffix(".csv").read_text().splitlines()) == len(wanted) + 1


@pytest.mark.parametrize(("options", "word"), [
    (("--from", "9"), "no frame"), (("--from", "1", "--to", "0.5"), "later"),
    (("--from", "-1"), "moment")])
def test_what_is_no_part_is_refused(recording: Path, tmp_path: Path, options: tuple[str, ...], word: str,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "part.rhotlog"
    assert main(["trim", str(recording), *options, "--out", str(out)]) == 2
    assert word in capsys.readouterr().err and [path.name for path in tmp_path.iterdir()] == [recording.name]


def test_nothing_is_written_over_unasked_and_never_the_recording(recording: Path, tmp_path: Path,
                                                                 capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "part.rhotlog"
    out.write_text("mine")
    assert main(["trim", str(recording), "--from", "0.5", "--out", str(out)]) == 2
    assert out.read_text() == "mine" and "--force" in capsys.readouterr().err
    before = recording.read_bytes()
    assert main(["trim", str(recording), "--from", "0.5", "--out", str(recording), "--force"]) == 2
    assert recording.read_bytes() == before
    assert main(["trim", str(recording), "--from", "0.5", "--out", str(out), "--force"]) == 0
    assert states_of_log(out)


def test_a_cancelled_trim_leaves_nothing(recording: Path, tmp_path: Path) -> None:
    class StopError(Exception):
        pass

    def stop(text: str, fraction: float) -> None:
        if fraction > 0.5:
            raise StopError

    with contextlib.closing(LogReader(recording)) as reader:
        write_film(video_path(recording, reader.rig.nodes[0].name), [1, 2])
    names = sorted(path.name for path in tmp_path.iterdir())
    with pytest.raises(StopError):
        trim_log(recording, tmp_path / "part.rhotlog", 0, 2**62, progress=stop)
    assert sorted(path.name for path in tmp_path.iterdir()) == names
