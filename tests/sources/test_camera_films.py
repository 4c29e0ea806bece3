"""Films that play in step: begun at one instant, and begun anew with the one of a dead node, once that is ready."""

from __future__ import annotations

from pathlib import Path

from rhot_app.sources.cameras.camera_set import CameraSet, LocalCamera
from rhot_app.sources.cameras.serve import Films


class Node:
    """A node that is alive and has said that it is ready, or not."""

    def __init__(self) -> None:
        self.alive, self.ready_waits, self.starts = True, False, 1


class Nodes:
    """A supervisor that starts a dead node again at each step."""

    def __init__(self, count: int) -> None:
        self.nodes = [Node() for _ in range(count)]

    def step(self) -> list[int]:
        dead = [number for number, node in enumerate(self.nodes) if not node.alive]
        for number in dead:
            self.start_again(number)
        return dead

    def start_again(self, number: int) -> None:
        node = self.nodes[number]
        node.alive, node.ready_waits, node.starts = True, False, node.starts + 1


def set_of(*films: bool) -> CameraSet:
    return CameraSet(tuple(LocalCamera(f"c{k}", f"/c{k}", 640, 480, 30.0, film) for k, film in enumerate(films)))


def test_only_films_wait_for_the_start(tmp_path: Path) -> None:
    films = Films(set_of(True, False, True), tmp_path / "start")
    assert films.specs == [f"/c0?start={tmp_path / 'start'}", "/c1", f"/c2?start={tmp_path / 'start'}"]


def test_films_begin_anew_together_once_the_dead_one_is_ready(tmp_path: Path) -> None:
    start = tmp_path / "start"
    films, nodes = Films(set_of(True, False, True), start), Nodes(3)
    films.begin()
    first_ns = int(start.read_text())
    films.follow(nodes)
    assert int(start.read_text()) == first_ns, "nothing happens while all is well"
    nodes.nodes[0].alive = False
    films.follow(nodes)
    assert not start.exists(), "or the new one would begin alone"
    nodes.nodes[0].alive = False
    films.follow(nodes)
    assert [node.starts for node in nodes.nodes] == [3, 1, 1], "one that cannot start leaves the others in peace"
    nodes.nodes[0].ready_waits = True
    films.follow(nodes)
    assert [node.starts for node in nodes.nodes] == [3, 1, 2] and not start.exists()
    nodes.nodes[2].ready_waits = True
    films.follow(nodes)
    assert int(start.read_text()) > first_ns


def test_the_death_of_a_webcam_leaves_films_alone(tmp_path: Path) -> None:
    films, nodes = Films(set_of(True, False, True), tmp_path / "start"), Nodes(3)
    films.begin()
    nodes.nodes[1].alive = False
    films.follow(nodes)
    assert (tmp_path / "start").exists() and [node.starts for node in nodes.nodes] == [1, 2, 1]
