"""Print the requirements of pyproject.toml (with an extra) that this Python does not satisfy.

`python missing.py CONSTRAINTS EXTRA`, EXTRA being "" for none, also writes to the file CONSTRAINTS the
versions of all other installed packages, so that installing the missing ones replaces none of them.
"""

import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distributions, version
from pathlib import Path

from pip._vendor.packaging.requirements import Requirement
from pip._vendor.packaging.utils import canonicalize_name
from pip._vendor.packaging.version import InvalidVersion, Version

project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
missing: dict[str, Requirement] = {}
extras = [project["optional-dependencies"][name] for name in sys.argv[2:] if name]
for text in sum(extras, project["dependencies"]):
    requirement = Requirement(text)
    if requirement.marker is not None and not requirement.marker.evaluate():
        continue
    try:
        if requirement.specifier.contains(version(requirement.name), prereleases=True):
            continue
    except PackageNotFoundError:
        pass
    missing[canonicalize_name(requirement.name)] = requirement
for requirement in missing.values():
    print(requirement)

constraints: dict[str, str] = {}
for distribution in distributions():
    name, installed = distribution.metadata["Name"], distribution.version
    try:
        Version(installed)
    except InvalidVersion:  # Debian has a few; pip could not read them either
        continue
    if name and canonicalize_name(name) not in missing:
        constraints.setdefault(canonicalize_name(name), installed)  # the first on the path wins
lines = [f"{name}=={installed}\n" for name, installed in sorted(constraints.items())]
Path(sys.argv[1]).write_text("".join(lines))
