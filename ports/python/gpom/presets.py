"""Hyperparameters that come with the package."""
from importlib import resources

from ._core import Params


def _folder():
    return resources.files(__package__) / "presets"


def preset_names():
    """Names of the presets. Their files, share/gpom/params of an installation, say what for."""
    return sorted(path.name.removesuffix(".toml") for path in _folder().iterdir()
                  if path.name.endswith(".toml"))


def preset(name):
    """Params of a preset, for example "indoor" or "street". Raises ValueError with all names."""
    if name not in preset_names():
        raise ValueError(f"preset: must be one of {', '.join(preset_names())}, is {name!r}")
    return Params.from_toml((_folder() / f"{name}.toml").read_text(encoding="utf-8"))
