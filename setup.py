"""What pyproject.toml cannot say: every package below `warpdyn`, and `data/` beside it as `warpdyn.data`."""

from setuptools import find_packages, setup

setup(packages=[*find_packages(include=["warpdyn*"]), "warpdyn.data"], package_dir={"warpdyn.data": "data"})
