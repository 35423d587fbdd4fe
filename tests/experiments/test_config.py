"""What a run is to do: from files, changed by options, refused where it makes no sense."""

import json

import pytest

from rtbench.errors import RtbenchError
from rtbench.experiments import config as configs
from rtbench.experiments.config import Config
from rtbench.kernels import registry


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "question.toml"
        path.write_text(text)
        return path

    return write


def test_a_file_is_read(written):
    path = written('kernels = ["moller*"]\ndensities = [0, 0.5]\ntriangles = 7\nprocesses = 2\n')
    found = configs.find(str(path))
    assert (found.name, found.kernels, found.densities) == ("question", ("moller*",), (0.0, 0.5))
    assert (found.triangles, found.processes, found.samples) == (7, 2, None)
    assert found.repetitions == 20_000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("densitys = [0.5]", "unknown key 'densitys'; did you mean 'densities'"),
        ('name = "x"', "unknown key 'name'"),
        ("densities = 0.5", "densities = 0.5 is not allowed .a list of float"),
        ('densities = ["0.5"]', "a list of float"),
        ('kernels = "moller1"', "a list of str"),
        ("triangles = 1.5", "triangles = 1.5 is not allowed .int"),
        ("triangles = true", "triangles = True is not allowed"),
        ("samples = [3]", "samples"),
        ("triangles = ", "is not TOML"),
        ("just words", "is not TOML"),
        ('experiment = "densty"', "did you mean 'density'"),
        ("kernels = []", "kernels is empty"),
        ('orders = ["sweep", "repeat", "sweep"]', "orders names 'sweep' twice"),
        ("densities = [nan]", "density nan is not allowed"),
        ("sizes = [4, 0]", "size 0 is not allowed"),
        ("sizes = [4, 4]", "sizes names 4 twice"),
        ("repetitions = 10\nprocesses = 4\nsamples = 3", "4 processes x 3 samples"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(written, text, said):
    with pytest.raises(RtbenchError, match=said) as raised:
        configs.find(str(written(text)))
    assert "\n" not in str(raised.value) and raised.value.exit_code == 2


def test_a_file_that_is_not_there_or_no_file(tmp_path, written):
    with pytest.raises(RtbenchError, match=r"unknown config 'blecha-4.22'; .*'blecha-4.2'"):
        configs.find("blecha-4.22")
    with pytest.raises(RtbenchError, match="unknown config"):
        configs.find(str(tmp_path / "blecha-4.2.toml"))  # there is none in that folder
    with pytest.raises(RtbenchError, match="cannot be read"):
        configs.find(str(tmp_path))
    path = written("")
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RtbenchError, match="is not TOML"):
        configs.find(str(path))


def test_options_override_and_what_is_not_given_stays():
    base = Config(triangles=10, densities=(0.5,))
    assert base.changed(triangles=None, densities=(), kernels=()) == base
    assert base.changed(triangles=20, densities=(0.0,)).densities == (0.0,)
    assert base.changed(seed=0).seed == 0
    with pytest.raises(RtbenchError, match="seed -1"):
        base.changed(seed=-1)


def test_quick_is_a_tenth_and_never_nothing():
    assert Config(repetitions=20_000).quick().repetitions == 2000
    assert Config(repetitions=3).quick().repetitions == 1


@pytest.mark.parametrize("name", configs.shipped())
def test_the_records_hold_a_whole_config(name):
    config = configs.find(name)
    assert Config.from_dict(json.loads(json.dumps(config.as_dict()))) == config


@pytest.mark.parametrize("name", configs.shipped())
def test_shipped_configs_name_what_exists(name):
    config = configs.find(name)
    assert configs.find(f"{name}.toml") == config
    assert config.name == name and config.title
    named = [name for name in config.kernels if "*" not in name]
    assert {kernel.name for kernel in registry.select(config.kernels)} >= {*named}
    if name.startswith("blecha-4"):
        assert f"blecha-{config.table}" == name
