"""The modules beside these tests, `tree_rules` and `tree_scenes`, are imported by name."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
