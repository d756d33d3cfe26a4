"""What a generated kernel uses of NVIDIA Warp, on one processor, for tests.

Before a kernel runs, its text is checked by the rules that Warp has for types: operands of an operation have the same type,
numbers in the text have 32 bits, a variable keeps its type, functions are those listed here or decorated. Calculations are those
of numpy's scalars, so that a float32 is rounded as such.
"""

import ast
import inspect
import math
import textwrap

import numpy as np

np.seterr(all="ignore")

float32, float64, int32 = np.float32, np.float64, np.int32


def _of_numbers(function):
    return lambda x: type(x)(function(x))


exp, tanh, sqrt, sin, cos, atan, abs = (
    _of_numbers(of) for of in (np.exp, np.tanh, np.sqrt, np.sin, np.cos, np.arctan, np.abs)
)
_UNARY = {"exp", "tanh", "sqrt", "sin", "cos", "atan", "abs"}


def pow(a, b):
    return type(a)(np.power(a, b))


class array:
    """Also the type of an argument: array(dtype=...)."""

    _DIMENSIONS = 1

    def __init__(self, data=None, dtype=None, device=None):
        self.dtype = dtype
        self.device = device
        self.data = None if data is None else np.array(data, dtype=dtype)

    @property
    def shape(self):
        return self.data.shape

    @property
    def type(self):
        return ("array", self.dtype.__name__, self._DIMENSIONS)

    def numpy(self):
        return self.data

    def zero_(self):
        self.data[...] = 0

    def __getitem__(self, place):
        self._check(place)
        return self.data[place]

    def __setitem__(self, place, value):
        self._check(place)
        if type(value) is not self.dtype:
            raise TypeError(f"a {type(value).__name__} into an array of {self.dtype.__name__}")
        self.data[place] = value

    def _check(self, place):
        # numpy counts negative places from the end; Warp reads what is before the array.
        places = place if isinstance(place, tuple) else (place,)
        if len(places) != self.data.ndim or any(not 0 <= p < n for p, n in zip(places, self.data.shape)):
            raise IndexError(f"{place} of {self.data.shape}")


class array2d(array):
    _DIMENSIONS = 2


def zeros(shape, dtype, device=None):
    data = np.zeros(shape, dtype)
    result = (array2d if data.ndim == 2 else array)(dtype=dtype, device=device)
    result.data = data
    return result


_thread = None


def tid():
    return _thread


class _Function:
    """A function of kernels."""

    def __init__(self, function):
        self.run = function
        self.name = function.__name__
        self.result = None
        self.arguments = list(_types(function).values())
        _check(self)

    def __call__(self, *arguments):
        return self.run(*arguments)


class _Kernel(_Function):
    pass


def set_module_options(options):
    if set(options) != {"enable_backward"}:
        raise ValueError(options)


def func(function):
    return _Function(function)


def kernel(function=None, *, enable_backward=True):
    return _Kernel if function is None else _Kernel(function)


def launch(kernel, dim, inputs=(), outputs=(), device=None):
    global _thread
    arguments = [*inputs, *outputs]
    kinds = [given.type if isinstance(given, array) else kind for given, kind in zip(arguments, kernel.arguments)]
    if len(arguments) != len(kernel.arguments) or kinds != kernel.arguments:
        raise TypeError(f"{kernel.name}: expected {kernel.arguments}, found {kinds}")
    # Numbers are converted to the type of the argument.
    arguments = [given if isinstance(given, array) else globals()[kind](given) for given, kind in zip(arguments, kinds)]
    for place in np.ndindex(dim):
        _thread = place if len(place) > 1 else place[0]
        kernel.run(*arguments)


def _type_name(annotation):
    if isinstance(annotation, array):
        return annotation.type
    return {bool: "bool", int: "int32", float: "float32"}.get(annotation, annotation.__name__)


def _types(function):
    return {name: _type_name(given) for name, given in inspect.get_annotations(function).items()}


def _check(function):
    text = textwrap.dedent(inspect.getsource(function.run))
    _Rules(function).of_body(ast.parse(text).body[0].body)


class _Rules:
    """The types of a function's variables."""

    def __init__(self, function):
        self.function = function
        self.known = function.run.__globals__
        self.types = _types(function.run)
        # Variables whose value is a number of the text: Warp does not change them in a loop.
        self.constants = set()
        self.in_loop = False

    def fail(self, node, why):
        raise TypeError(f"{self.function.name}: {ast.unparse(node)}: {why}")

    def of_body(self, body):
        for statement in body:
            getattr(self, "of_" + type(statement).__name__)(statement)

    def of_Assign(self, node):
        (target,) = node.targets
        kind = self.type(node.value)
        if isinstance(target, ast.Subscript):
            if self.type(target) != kind:
                self.fail(node, f"a {kind} into {self.type(target)}")
            return
        if isinstance(target, ast.Tuple):
            for name in target.elts:
                self.types[name.id] = "int32"
            return
        if self.types.setdefault(target.id, kind) != kind:
            self.fail(node, f"the variable has the type {self.types[target.id]}, not {kind}")
        if self.in_loop and target.id in self.constants:
            self.fail(node, "a constant changes in a loop")
        # A cast of a number in the text may be a constant, but for int(0), which Warp recommends.
        is_cast = isinstance(node.value, ast.Call) and all(isinstance(a, ast.Constant) for a in node.value.args)
        if isinstance(node.value, ast.Constant) or (is_cast and node.value.args and self.called(node.value) is not int):
            self.constants.add(target.id)

    def of_For(self, node):
        if node.iter.func.id != "range":
            self.fail(node, "a loop over what is not a range")
        for bound in node.iter.args:
            if self.type(bound) != "int32":
                self.fail(bound, "a bound that is not a whole number")
        self.types[node.target.id] = "int32"
        before, self.in_loop = self.in_loop, True
        self.of_body(node.body)
        self.in_loop = before

    def of_If(self, node):
        if self.type(node.test) != "bool":
            self.fail(node.test, "a condition that is not a truth")
        self.of_body(node.body)
        self.of_body(node.orelse)

    def of_Return(self, node):
        kind = self.type(node.value)
        self.function.result = self.function.result or kind
        if self.function.result != kind:
            self.fail(node, f"returns {kind} and {self.function.result}")

    def type(self, node):
        return getattr(self, "type_of_" + type(node).__name__)(node)

    def type_of_Name(self, node):
        return self.types[node.id]

    def type_of_Constant(self, node):
        return {bool: "bool", int: "int32", float: "float32"}[type(node.value)]

    def type_of_UnaryOp(self, node):
        kind = self.type(node.operand)
        if isinstance(node.op, ast.Not) != (kind == "bool"):
            self.fail(node, f"of {kind}")
        return kind

    def type_of_BinOp(self, node):
        left, right = self.type(node.left), self.type(node.right)
        if left != right or left == "bool":
            self.fail(node, f"of {left} and {right}")
        return left

    def type_of_BoolOp(self, node):
        if any(self.type(value) != "bool" for value in node.values):
            self.fail(node, "of what is not a truth")
        return "bool"

    def type_of_Compare(self, node):
        (right,) = node.comparators
        if self.type(node.left) != self.type(right):
            self.fail(node, f"of {self.type(node.left)} and {self.type(right)}")
        return "bool"

    def type_of_Subscript(self, node):
        kind, dtype, dimensions = self.type(node.value)
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if kind != "array" or len(places) != dimensions or any(self.type(place) != "int32" for place in places):
            self.fail(node, f"an element of an array of {dimensions} dimensions")
        return dtype

    def called(self, node):
        if isinstance(node.func, ast.Attribute):
            return globals()[node.func.attr]
        return {"int": int}.get(node.func.id) or self.known[node.func.id]

    def type_of_Call(self, node):
        called = self.called(node)
        kinds = [self.type(argument) for argument in node.args]
        if called is tid:
            return "int32"
        if called in (float32, float64, int32, int):
            if kinds == ["bool"]:
                self.fail(node, "a truth as a number")
            value = node.args[0]
            if isinstance(value, ast.UnaryOp):
                value = value.operand
            if called is float64 and isinstance(value, ast.Constant) and not _is_exact(value.value):
                self.fail(node, "a number that Warp rounds to 32 bits")
            return "int32" if called is int else called.__name__
        if isinstance(called, _Function):
            if kinds != called.arguments:
                self.fail(node, f"expected {called.arguments}, found {kinds}")
            return called.result
        name = node.func.attr
        if name not in _UNARY | {"pow"} or any(kind not in ("float32", "float64") for kind in kinds):
            self.fail(node, f"of {kinds}")
        if len(kinds) != (2 if name == "pow" else 1) or len(set(kinds)) != 1:
            self.fail(node, f"of {kinds}")
        return kinds[0]


def _is_exact(value):
    return math.isfinite(value) and float(np.float32(value)) == value
