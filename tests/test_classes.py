"""A class is abstract or final: what is implemented is not overridden, and what is inherited from is abstract."""

import functools
import importlib
import inspect
import pkgutil
from abc import ABC
from types import FunctionType

import pytest
import railcosim.components
import railcosim.fmus
import railcosim.orchestrator

PACKAGES = (railcosim.components, railcosim.fmus, railcosim.orchestrator)
METHODS = (FunctionType, property, functools.cached_property, classmethod, staticmethod)


def own_classes():
    """Every class of the three packages, in whatever module it stands."""
    for package in PACKAGES:
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if found.name.endswith(".__main__"):
                continue
            module = importlib.import_module(found.name)
            yield from (c for c in vars(module).values() if inspect.isclass(c) and c.__module__ == found.name)


CLASSES = list(own_classes())


def overridden(cls, known=None):
    """Methods of a class that one of its bases implements; bases from outside are not ours to judge."""
    bases = [base for base in cls.__mro__[1:] if base in (known or CLASSES)]
    for name, member in vars(cls).items():
        if isinstance(member, METHODS) and not (name.startswith("__") and name.endswith("__")):
            for base in bases:
                inherited = vars(base).get(name)
                if isinstance(inherited, METHODS) and not getattr(inherited, "__isabstractmethod__", False):
                    yield f"{cls.__name__}.{name} overrides {base.__name__}.{name}"


def test_there_are_classes_to_judge():
    names = {cls.__name__ for cls in CLASSES}
    assert {"Cailc", "Annotation", "LoadedSlave"} <= names


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__qualname__)
def test_no_implemented_method_is_overridden(cls):
    assert list(overridden(cls)) == []


def test_a_class_that_others_inherit_from_is_abstract():
    """By an open method, or by ``ABC`` among its bases. Errors are told apart by class, and all are raised."""
    parents = {base for cls in CLASSES for base in cls.__bases__ if base in CLASSES and not issubclass(base, Exception)}
    assert [c.__name__ for c in parents if not inspect.isabstract(c) and ABC not in c.__bases__] == []


def test_the_rule_sees_an_override():
    class Base(ABC):  # noqa: B024 (what is wrong with it is the point)
        def said(self):
            return 1

        @property
        def shown(self):
            return 2

    class Derived(Base):
        def said(self):
            return 3

        shown = property(lambda self: 4)

    assert list(overridden(Derived, [Base])) == [
        "Derived.said overrides Base.said",
        "Derived.shown overrides Base.shown",
    ]
