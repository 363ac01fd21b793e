"""The command `lobefem`: options, commands, tables, progress, exit codes.

Nothing outside this room imports it.
"""

from __future__ import annotations
