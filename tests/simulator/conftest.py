"""The programs that this room starts begin as forks. Both hands."""

from processes import forked_programs, fresh_programs  # noqa: F401
from shipped_rig import model  # noqa: F401
