"""The modules beside these tests, `bounded`, `running_error` and `truth`, are imported by name."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
