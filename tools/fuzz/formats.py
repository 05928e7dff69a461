"""Every format that is read."""

from tools.fuzz import foreign, own

MAKERS = own.MAKERS | foreign.MAKERS
"""What can be fuzzed, by name; each makes its sample in a folder."""
