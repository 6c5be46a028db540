"""How much memory there is."""

from __future__ import annotations

import os
from pathlib import Path


def machine_memory() -> int | None:
    """The memory of the machine, or of the container [byte]; None where the system does not say."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
    container = Path("/sys/fs/cgroup/memory.max")
    given = container.read_text().strip() if container.exists() else ""
    return min(memory, int(given)) if given.isdigit() else memory
