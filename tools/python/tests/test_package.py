"""What holds of the package as a whole."""

import ast
import inspect
import math
from importlib.resources import files

import pytest

import stillbeam
from stillbeam import _stillbeam
from stillbeam.display import with_error


def test_everything_public_says_what_it_is():
    for name in stillbeam.__all__:
        thing = getattr(stillbeam, name)
        assert inspect.getdoc(thing), name
        methods = inspect.getmembers(thing, inspect.isfunction) if inspect.isclass(thing) else []
        for method, function in methods:
            assert method.startswith("_") or inspect.getdoc(function), f"{name}.{method}"


def test_the_stub_has_what_the_extension_has():
    stub = ast.parse(files(stillbeam).joinpath("_stillbeam.pyi").read_text())
    kinds = (ast.FunctionDef, ast.ClassDef)
    stubbed = {node.name: node for node in stub.body if isinstance(node, kinds)}
    real = {name: thing for name, thing in vars(_stillbeam).items() if not name.startswith("_")}
    assert set(stubbed) == set(real)
    for name, node in stubbed.items():
        if isinstance(node, ast.FunctionDef):
            assert [argument.arg for argument in node.args.args] == list(inspect.signature(real[name]).parameters)
    methods = {node.name for node in stubbed["Board"].body if isinstance(node, ast.FunctionDef)}
    public = {name for name in vars(_stillbeam.Board) if not name.startswith("_")}
    assert methods - {"__new__"} == public


@pytest.mark.parametrize(
    ("value", "stderr", "shown"),
    [
        (1.09812, 0.00031, "1.09812 ± 0.00031"),
        (12.3, 4.0, "12.3 ± 4.0"),
        (250.0, 30.0, "250 ± 30"),
        (2.5, math.nan, "2.5"),
        (2.5, None, "2.5"),
        (3.0e9, 1.0e8, "3e+09 ± 1e+08"),
    ],
)
def test_a_number_has_the_digits_that_its_error_leaves(value, stderr, shown):
    assert with_error(value, stderr) == shown
