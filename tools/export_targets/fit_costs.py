"""The prices that the estimates of `torsio export` consist of: least squares of the relative errors over the models that are
not held out, and the errors on those that are."""
import pathlib
import re

import numpy as np
from models import MODELS
from scipy.optimize import lsq_linear

HERE = pathlib.Path(__file__).resolve().parent
C_COST = HERE.parent.parent / 'src/export/c_cost.cpp'
WEAK = 1e-3  # of a pull towards 0, by which parts that always occur together share their price
WEAK_STACK = 1e-2
LARGE = 0.15  # of an error
ROUNDS = 2
ARRAYS = {'instructions': ('work', 'instructions'), 'code_bytes': ('code', 'flash'), 'stack_bytes': ('stack', 'stack')}


def prices(parts, amounts, measured, weak, free):
    """Least squares of (parts @ prices - amounts) / measured; prices are not negative, but for the column `free`."""
    rows = parts / measured[:, None]
    pull = weak * np.diag(np.sqrt((rows ** 2).sum(axis=0)) + 1e-9)
    lowest = np.zeros(parts.shape[1])
    if free is not None:
        lowest[free] = -np.inf
    weights = np.ones(len(rows))
    for _ in range(ROUNDS):
        found = lsq_linear(np.vstack([weights[:, None] * rows, pull]),
                           np.concatenate([weights * amounts / measured, np.zeros(parts.shape[1])]), bounds=(lowest, np.inf)).x
        # The largest errors count more: what is promised is a limit of each, not their mean square.
        errors = np.abs(rows @ found - amounts / measured)
        weights *= np.sqrt(1.0 + errors / LARGE)
        weights /= weights.mean()
    return found


def errors_text(names, errors):
    worst = np.argsort(-np.abs(errors))[:3]
    return (f'{len(errors):3} programs, largest {100.0 * np.abs(errors).max():5.1f} %, root mean square '
            f'{100.0 * np.sqrt((errors ** 2).mean()):4.1f} % ('
            + ', '.join(f'{names[i]} {100.0 * errors[i]:+.1f}' for i in worst) + ')')


def fit_target(rows):
    """Prints the errors of one target and type; returns the prices of its programs' parts by array of `CTarget::Prices`."""
    found = {}
    all_rows = rows
    for array, (part, what) in ARRAYS.items():
        rows = [row for row in all_rows if part in row['parts']]
        names = np.array([row['label'] for row in rows])
        held = np.array([row['held_out'] for row in rows])
        kinds = list(rows[0]['parts'][part])
        parts = np.array([[row['parts'][part][kind] for kind in kinds] for row in rows], dtype=float)
        measured = np.array([row['measured'][what] for row in rows], dtype=float)
        known = np.array([row['tables'] for row in rows], dtype=float) if what == 'flash' else np.zeros(len(rows))
        # A call that is compiled into its caller makes a small program cheaper than in proportion.
        free = kinds.index('program') if 'program' in kinds else None
        own = prices(parts[~held], (measured - known)[~held], measured[~held], WEAK_STACK if what == 'stack' else WEAK, free)
        own = np.array([float(f'{price:.4g}') if abs(price) > 0.005 else 0.0 for price in own])
        errors = (parts @ own + known) / measured - 1.0
        print(f'  {what:12} fitted:   {errors_text(names[~held], errors[~held])}')
        print(f'  {"":12} held out: {errors_text(names[held], errors[held])}')
        found[array] = dict(zip(kinds, own))
    return found


def array_text(kinds, found):
    """Numbers in the order of an enum of c_cost.hpp."""
    return ', '.join(f'{found[kind]:.4g}' if '.' in f'{found[kind]:.4g}' or 'e' in f'{found[kind]:.4g}'
                     else f'{found[kind]:.4g}.0' for kind in kinds)


def enum_names(name):
    """The kinds of an enum of c_cost.hpp, in their order."""
    text = (C_COST.parent.parent.parent / 'include/torsio/export/c_cost.hpp').read_text()
    body = re.search(rf'enum class {name} : std::uint8_t {{(.*?)}};', text, re.DOTALL).group(1)
    return re.findall(r'^\s*(\w+),', body, re.MULTILINE)


def constants_text(all_found):
    lines = []
    for constant, found in all_found.items():
        lines += [f'constexpr CTarget::Prices {constant}{{']
        for array, enum in (('instructions', 'CWork'), ('code_bytes', 'CCode'), ('stack_bytes', 'CStack')):
            lines.append(f'    .{array} = {{{array_text(enum_names(enum), found[array])}}},')
        lines.append('};')
    return '\n'.join(lines) + '\n'


def fit_all(by_target, is_written):
    """Fits and prints everything. @param by_target: (name of the constant, text) -> rows of `fit_target`"""
    found = {}
    for (constant, what), rows in by_target.items():
        print(what)
        found[constant] = fit_target(rows)
    text = constants_text(found)
    print('\n' + text)
    if is_written:
        source = C_COST.read_text()
        head, rest = source.split('// PRICES BEGIN\n')
        C_COST.write_text(head + '// PRICES BEGIN\n' + text + '// PRICES END' + rest.split('// PRICES END')[1])
        print(f'{C_COST} written: format it with clang-format-16')
    return 0


def fit(workshop, flags, targets, exported, measured):
    by_target = {}
    for model in MODELS:
        if flags.only and model.name not in flags.only:
            continue
        for real in ('float', 'double'):
            for has_counts in ((False, True) if model.counts else (False,)):
                program = exported(workshop, model, real, has_counts)
                for target in targets:
                    if real not in target.reals:
                        continue
                    own = measured(program, target, workshop)
                    print(f'{program.label:26} {target.name} {real}: {own}', flush=True)
                    rows = by_target.setdefault((target.constants + real.capitalize(), f'{target.name} {real}'), [])
                    parts = program.estimate['parts']
                    rows.append({'label': program.label, 'held_out': model.is_held_out, 'parts': parts,
                                 'tables': program.estimate['table_bytes'], 'measured': own})
                    if model.controller:
                        rows.append({'label': f'{program.label}, loop', 'held_out': model.is_held_out,
                                     'parts': {'work': parts['control_work'], 'stack': parts['control_stack']},
                                     'tables': 0, 'measured': own['control']})
    return fit_all(by_target, flags.write)
