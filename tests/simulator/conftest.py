"""The programs that this room starts begin as forks."""

from processes import forked_programs, fresh_programs  # noqa: F401
