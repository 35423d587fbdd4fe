"""The module beside these tests, `compiled_functions`, is imported by name."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
