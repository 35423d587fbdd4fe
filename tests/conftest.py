"""What is compiled in a test session goes into a cache folder of its own, gone at its end."""

import atexit
import os
import shutil
import tempfile

# Set before anything is imported: sub-processes of the tests inherit it, and so do the workers of
# one session, so that what one compiles the others load. Who runs a few tests again and again may
# keep the folder: RTBENCH_TESTS_CACHE_DIR.
kept = os.environ.get("RTBENCH_TESTS_CACHE_DIR")
if "PYTEST_XDIST_WORKER" in os.environ:
    kept = kept or os.environ.get("RTBENCH_TESTS_SESSION_DIR")
folder = kept or tempfile.mkdtemp(prefix="rtbench-tests-")
os.environ["RTBENCH_CACHE_DIR"] = os.environ["RTBENCH_TESTS_SESSION_DIR"] = folder
os.environ.setdefault("MPLCONFIGDIR", folder)
if not kept:
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
