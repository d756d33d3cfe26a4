#!/usr/bin/python3
"""Exports models of every family as C99 and checks the programs on the machines that they are for.

Hosts: gcc, clang, cppcheck, WebAssembly in Node, a MEX file in Octave. Targets: Cortex-M4F and Cortex-M7 in qemu, where the
self-test runs, constants that are 1 % wrong make it fail, and instructions, code and stack are compared with the estimates of
`torsio export`, which must be within 15 %. With --fit it measures more models, fits the prices that the estimates consist
of, and prints them for src/export/c_cost.cpp.

    ./run long export
    tools/export_targets/export_targets.py --torsio build/apps/torsio/torsio --folder build/export_targets --fit
"""
import argparse
import csv
import dataclasses
import functools
import hashlib
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
from models import CONTROLLERS, MODELS, REACH, RECORDINGS, Model

HERE = pathlib.Path(__file__).resolve().parent
LARGEST_ERROR = 0.15
TOLERANCE = {'float': 1e-4, 'double': 1e-6}  # of the self-test, as a share of the range
COUNTS_PER_TURN = 524288
WARM_UP, TICKS = 600, 1600  # of the recording, the former before instructions are counted

WARNINGS = ['-std=c99', '-pedantic', '-Wall', '-Wextra', '-Wconversion', '-Wdouble-promotion', '-Werror', '-ffreestanding']


@dataclasses.dataclass(frozen=True)
class Target:
    name: str  # as `torsio export` has it
    reals: tuple
    flags: tuple
    machine: str  # of qemu
    constants: str  # prefix in c_cost.cpp


TARGETS = [
    Target('cortex-m4f', ('float',), ('-mcpu=cortex-m4', '-mthumb', '-mfloat-abi=hard', '-mfpu=fpv4-sp-d16'), 'mps2-an386',
           'kM4f'),
    Target('cortex-m7', ('float', 'double'), ('-mcpu=cortex-m7', '-mthumb', '-mfloat-abi=hard', '-mfpu=fpv5-d16'),
           'mps2-an500', 'kM7'),
]


class Failures:
    """What went wrong; the program continues, so that all of it is seen."""

    def __init__(self):
        self.texts = []

    def add(self, text):
        self.texts.append(text)
        print(f'FAILED: {text}', flush=True)


def run(command, **options):
    """Runs a command; its output is an error message where it fails."""
    done = subprocess.run([str(each) for each in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)
    if done.returncode != 0:
        raise RuntimeError(f'{" ".join(str(each) for each in command)}\n{done.stdout}')
    return done.stdout


# Models

class Workshop:
    """Recordings and models, which are made once."""

    def __init__(self, torsio, folder):
        self.torsio = torsio
        self.folder = folder
        (folder / 'models').mkdir(parents=True, exist_ok=True)

    def recording(self, name):
        path = self.folder / 'models' / f'{name}.csv'
        if path.exists():
            return path
        arguments, column = RECORDINGS[name]
        run([self.torsio, 'simulate', *arguments.split(), '-o', path])
        if column:  # a channel that is constant in a recording
            lines = path.read_text().splitlines()
            path.write_text('\n'.join([lines[0] + ',' + column[0], *(f'{line},{column[1]}' for line in lines[1:])]) + '\n')
        return path

    def model(self, model):
        path = self.folder / 'models' / f'{model.name}.safetensors'
        if path.exists():
            return path
        command = [self.torsio, 'fit', *map(self.recording, model.recordings), '--model', model.family]
        for setting in model.settings.split():
            command += ['--set', setting]
        if model.inputs:
            command += ['--inputs', model.inputs, '--target', model.target]
        run([*command, '--seed', '1', '-o', path])
        return path

    def controller(self, name):
        path = self.folder / 'models' / f'{name}.yaml'
        if path.exists():
            return path
        arguments, edit = CONTROLLERS[name]
        run([self.torsio, 'tune-loop', *arguments.split(), '-o', path])
        if edit:
            path.write_text(re.sub(*edit, path.read_text(), flags=re.MULTILINE))
        return path


# Programs

@functools.lru_cache(maxsize=None)
def rows_of(recording, first):
    """The names of the channels, and the ticks from this row on."""
    with open(recording, newline='') as file:
        lines = list(itertools.islice(csv.reader(file), first + 1 + TICKS))
    values = np.array([[float(value or 'nan') for value in line] for line in lines[1 + first:]])
    if len(values) != TICKS:
        raise RuntimeError(f'{recording}: {first + TICKS} rows expected')
    channels = lines[0]
    if 'gear_angle_rad' in channels:
        deflection = values[:, channels.index('gear_angle_rad')] - values[:, channels.index('joint_angle_rad')]
        return [*channels, 'spring_deflection_rad'], np.column_stack([values, deflection])
    return channels, values


@dataclasses.dataclass
class Program:
    """A model that was exported, in a folder of its own."""
    model: Model
    real: str
    has_counts: bool
    folder: pathlib.Path
    estimate: dict
    inputs: list  # channels, in the order of the step's arguments
    counted: list  # whether they are given as counts
    zeros: list  # channels with a zero
    sample: list  # channels of the controller's sample, and whether each is given as counts

    @property
    def label(self):
        return f'{self.model.name}{", counts" if self.has_counts else ""}'

    def columns(self, recording, names, counted):
        """Channels of a recording, as the program takes them."""
        channels, values = rows_of(recording, self.model.first_row)
        rows = values[:, [channels.index(channel) for channel in names]]
        per_rad = COUNTS_PER_TURN / (2.0 * np.pi)
        for i, is_counted in enumerate(counted):
            if is_counted:
                rows[:, i] = np.round(rows[:, i] * per_rad)
            elif self.real == 'float':
                rows[:, i] = rows[:, i].astype(np.float32)
        return rows

    def rows(self, recording):
        """Raw inputs of ticks."""
        return self.columns(recording, self.inputs, self.counted)

    def types(self):
        return types_of(self.counted)

    def table(self, name, kind, column):
        """Numbers as a C table."""
        values = [f'{value:.0f}' if kind == 'int32_t' else repr(float(value)) + ('F' if self.real == 'float' else '')
                  for value in column]
        return f'static const {kind} {name}[] = {{{", ".join(values)}}};'

    def set_zeros(self):
        return ' '.join(f'joint_set_zero_{channel}(&state, 0);' for channel in self.zeros)


def types_of(counted):
    return ['int32_t' if is_counted else 'joint_real' for is_counted in counted]


def exported(workshop, model, real, has_counts):
    folder = workshop.folder / 'programs' / f'{model.name}-{real}{"-counts" if has_counts else ""}'
    folder.mkdir(parents=True, exist_ok=True)
    path = workshop.model(model)
    command = [workshop.torsio, 'export', path, '--c99', 'joint', '--real', real, '-o', folder, '--overwrite', '--json', '-']
    if has_counts:
        for channel in model.counts:
            command += ['--counts', f'{channel}={COUNTS_PER_TURN}']
    if model.controller:
        command += ['--controller', workshop.controller(model.controller)]
    text = run(command)
    estimate = json.loads(text[text.index('{'):])
    header = (folder / 'joint.h').read_text()
    parameters = re.search(r'joint_step\(joint_state \*state,\s*([^)]*)\)', header).group(1).split(',')
    names = [parameter.split()[-1] for parameter in parameters]
    counted = [name.endswith('_counts') for name in names]
    inputs = [re.sub('_counts$', '_rad', name) for name in names]
    zeros = re.findall(r'joint_set_zero_(\w+)\(', header)
    counts = model.counts if has_counts else ()
    sample = [(f'{side}_angle_rad', f'{side}_angle_rad' in counts) for side in ('motor', 'gear', 'joint')]
    program = Program(model, real, has_counts, folder, estimate, inputs, counted, zeros, sample)
    row = ', '.join(f'({kind})row[{i}]' for i, kind in enumerate(program.types()))
    (folder / 'rows.h').write_text(f'#define INPUT_COUNT {len(inputs)}\n#define FROM_ROW(row) {row}\n'
                                   f'#define SET_ZEROS {program.set_zeros()}\n')
    return program


# Hosts

def check_compilers(program, failures):
    source = program.folder / 'joint.c'
    for compiler in (['gcc', '-O2'], ['clang', '-O2'],
                     *(['arm-none-eabi-gcc', '-O2', *target.flags] for target in TARGETS)):
        for self_test in ([], ['-DJOINT_SELF_TEST']):
            try:
                run([*compiler, *WARNINGS, *self_test, '-c', source, '-o', program.folder / 'check.o'])
            except RuntimeError as error:
                failures.add(f'{program.label} {program.real}: {error}')
    try:
        # variableScope: variables are declared at the beginning of a function.
        # ctuuninitvar: a function fills a struct of its caller; cppcheck takes the address of an array in it for its values.
        run(['cppcheck', '--enable=warning,style,performance,portability', '--error-exitcode=1', '--std=c99', '--quiet',
             '--suppress=ctuuninitvar', '--suppress=variableScope', '-DJOINT_SELF_TEST', source])
    except RuntimeError as error:
        failures.add(f'{program.label} {program.real}: {error}')


def check_host(program, workshop, failures):
    """Makes inputs.bin and outputs.bin, to which the other hosts compare."""
    program.rows(workshop.recording(program.model.drive)).tofile(program.folder / 'inputs.bin')
    folder = program.folder
    options = ['-DJOINT_SELF_TEST', f'-DTOLERANCE={TOLERANCE[program.real]}', '-O2', '-ffp-contract=off', f'-I{folder}']
    try:
        run(['gcc', '-std=c99', *options, folder / 'joint.c', HERE / 'host.c', '-o', folder / 'host'])
        return run([folder / 'host'], cwd=folder).split()[0]
    except RuntimeError as error:
        failures.add(f'{program.label} {program.real} on the host: {error}')
        return 'failed'


def check_wasm(program, failures):
    folder = program.folder
    try:
        run(['clang', '--target=wasm32', '-std=c99', '-O2', '-ffreestanding', '-nostdlib', '-ffp-contract=off', f'-I{folder}',
             '-DJOINT_SELF_TEST', folder / 'joint.c', HERE / 'wasm.c', '-Wl,--no-entry', '-o', folder / 'joint.wasm'])
        run(['node', HERE / 'run_wasm.mjs', folder, str(TOLERANCE[program.real])])
        return 'equal'
    except RuntimeError as error:
        failures.add(f'{program.label} {program.real} as WebAssembly: {error}')
        return 'failed'


def check_mex(program, failures):
    folder = program.folder
    try:
        run(['mkoctfile', '--mex', '-std=c99', '-O2', '-ffp-contract=off', f'-I{folder}', '-DJOINT_SELF_TEST', folder / 'joint.c',
             HERE / 'mex.c', '-o', folder / 'joint.mex'], cwd=folder)
        run(['octave-cli', '--norc', HERE / 'run_mex.m', folder, str(TOLERANCE[program.real])])
        return 'equal'
    except RuntimeError as error:
        failures.add(f'{program.label} {program.real} in Octave: {error}')
        return 'failed'


# Targets

STIFFNESS_Nm_rad = 100.0  # of the impedance that a control step follows


def write_drive(program, workshop):
    """A recording as C tables, and how a step is called."""
    recording = workshop.recording(program.model.drive)
    lines = [program.table(f'input_{i}', kind, column)
             for i, (kind, column) in enumerate(zip(program.types(), program.rows(recording).T))]
    if program.model.controller:
        names, counted = zip(*program.sample)
        kinds = types_of(counted)
        lines += [program.table(f'sample_{i}', kind, column)
                  for i, (kind, column) in enumerate(zip(kinds, program.columns(recording, names, counted).T))]
        # The impedance asks for the torque that was measured, so that the loops have ordinary errors.
        current_A, angle_rad, torque_Nm = program.columns(
            recording, ('motor_current_A', 'joint_angle_rad', 'torque_Nm'), (False, False, False)).T
        lines += [program.table('current_A', 'joint_real', current_A),
                  program.table('wanted_rad', 'joint_real', angle_rad + torque_Nm / STIFFNESS_Nm_rad),
                  f'#define STIFFNESS {STIFFNESS_Nm_rad}F']
    count = len(program.inputs)
    lines += [f'#define WARM_UP {WARM_UP}U', f'#define TICKS {TICKS}U', f'#define SET_ZEROS {program.set_zeros()}',
              '#define PARAMETERS ' + ', '.join(f'{kind} in_{i}' for i, kind in enumerate(program.types())),
              '#define INPUTS(k) ' + ', '.join(f'input_{i}[k]' for i in range(count)),
              '#define UNUSED ' + ' '.join(f'(void)in_{i};' for i in range(count))]
    (program.folder / 'drive.h').write_text('\n'.join(lines) + '\n')


def in_qemu(program, target, source, options):
    """The exit code and the output of bench.c."""
    image = program.folder / f'{target.name}.elf'
    run(['arm-none-eabi-gcc', '-std=c99', '-O2', '-ffreestanding', *target.flags, f'-I{program.folder}', *options, source,
         HERE / 'bench.c', HERE / 'start.c', '-T', HERE / 'link.ld', '-nostartfiles', '--specs=nosys.specs', '-o', image])
    done = subprocess.run(['qemu-system-arm', '-M', target.machine, '-nographic', '-semihosting', '-icount', 'shift=0',
                           '-kernel', str(image)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300)
    return done.returncode, done.stdout


def self_test(program, target, source=None):
    return in_qemu(program, target, source or program.folder / 'joint.c',
                   ['-DJOINT_SELF_TEST', f'-DTOLERANCE={TOLERANCE[program.real]}'])


def with_wrong_constants(program):
    """The program with the inner half of a table of the model 1 % larger, which a step surely uses."""
    text = (program.folder / 'joint.c').read_text()
    tables = re.findall(r'static const (?:float|joint_real) (joint_\w+)\[\d+\] = \{([^}]*)\};', text)
    for wanted in ('coefficients', 'network_0_weights', 'layer_0_input', 'weights', 'branch_gain', 'input_curve_values'):
        for name, numbers in tables:
            if name == f'joint_{wanted}':
                values = [each.strip() for each in numbers.split(',')]
                for i in range(len(values) // 4, len(values) - len(values) // 4):
                    values[i] = repr(1.01 * float(values[i].rstrip('F'))) + ('F' if values[i].endswith('F') else '')
                path = program.folder / 'wrong.c'
                path.write_text(text.replace(numbers, ', '.join(values)))
                return path
    raise RuntimeError(f'{program.label}: no table to change')


def stack_bytes(graph, function):
    """Of the deepest chain of calls from a function, by the graph of gcc's -fcallgraph-info=su."""
    own, calls = {}, {}
    for title, label in re.findall(r'node: { title: "([^"]*)" label: "([^"]*)"', graph):
        size = re.search(r'(\d+) bytes \((\w+)', label)
        own[title] = int(size.group(1)) if size else 0
        if size and size.group(2) == 'dynamic':
            raise RuntimeError(f'{title} has a stack without a limit')
    for caller, called in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', graph):
        calls.setdefault(caller, []).append(called)

    def deepest(title, above):
        if title in above:
            raise RuntimeError(f'{title} calls itself')
        return own.get(title, 0) + max((deepest(each, above | {title}) for each in calls.get(title, [])), default=0)

    return deepest(function, frozenset())


def measured(program, target, workshop):
    """Flash, stack, instructions and state of a program, from a cache if it is the same as then."""
    source = (program.folder / 'joint.c').read_text()
    write_drive(program, workshop)
    key = hashlib.sha256('\n'.join([source, (program.folder / 'drive.h').read_text(), (HERE / 'bench.c').read_text(),
                                    *target.flags]).encode()).hexdigest()
    cache = workshop.folder / 'measured' / f'{key}.json'
    if cache.exists():
        return json.loads(cache.read_text())
    folder = program.folder
    run(['arm-none-eabi-gcc', *target.flags, *WARNINGS, '-O2', '-fcallgraph-info=su', '-c', folder / 'joint.c', '-o',
         folder / 'joint.o'])
    size = run(['arm-none-eabi-size', folder / 'joint.o']).splitlines()[1].split()
    missing = run(['arm-none-eabi-nm', '-u', folder / 'joint.o']).split()[1::2]
    def executed(options):
        code, output = in_qemu(program, target, folder / 'joint.c', options)
        numbers = {what: int(number) for what, number in re.findall(r'(.*?):? (\d+)\n', output)}
        if code != 0 or 'faults' not in numbers:
            raise RuntimeError(f'{program.label} {program.real} on {target.name}: exit code {code}\n{output}')
        return numbers

    numbers = executed([])
    result = {'flash': int(size[0]), 'data': int(size[1]) + int(size[2]), 'missing': missing,
              'stack': stack_bytes((folder / 'joint.ci').read_text(), 'joint_step'),
              'instructions': numbers['tenths of an instruction a step'] / 10.0, 'faults': numbers['faults'],
              'state': numbers['state bytes']}
    if program.model.controller:
        numbers = executed(['-DCONTROL'])
        result['control'] = {'stack': stack_bytes((folder / 'joint.ci').read_text(), 'joint_control_step'),
                             'instructions': numbers['tenths of an instruction a step'] / 10.0, 'faults': numbers['faults']}
        result['state'] = numbers['state bytes']
    cache.parent.mkdir(exist_ok=True)
    cache.write_text(json.dumps(result))
    return result


def check_target(program, target, failures):
    """The self-test passes, and fails with wrong constants."""
    result = []
    try:
        code, output = self_test(program, target)
        if code != 0:
            failures.add(f'{program.label} {program.real} on {target.name}: the self-test: {output}')
        result.append(re.sub(r'.*: (\d+)\n', r'\1', output) + 'e-9')
        code, output = self_test(program, target, with_wrong_constants(program))
        if code == 0:
            failures.add(f'{program.label} {program.real} on {target.name}: the self-test passes with wrong constants')
        result.append('fails' if code != 0 else 'passes')
    except RuntimeError as error:
        failures.add(str(error))
    return result


def programs_of(workshop, models):
    for model in models:
        for real in ('float', 'double'):
            for has_counts in ((False, True) if model.counts else (False,)):
                yield exported(workshop, model, real, has_counts)


# Estimates

def compare(program, target, workshop, failures, largest):
    """A line of the table: measured, estimated, error in per cent."""
    own = measured(program, target, workshop)
    if own['missing'] and program.real == 'float':
        failures.add(f'{program.label} {program.real} on {target.name}: undefined symbols {own["missing"]}')
    if own['state'] != program.estimate['state_bytes']:
        failures.add(f'{program.label} {program.real} on {target.name}: a state of {own["state"]} bytes, '
                     f'{program.estimate["state_bytes"]} expected')
    estimate = next(each for each in program.estimate['targets'] if each['target'] == target.name)

    def line_of(label, found, estimated):
        line = f'{label:26} {program.model.family:20} {target.name:10} {program.real:6}'
        if found['faults'] > 0.02 * (TICKS - WARM_UP):
            failures.add(f'{label} {program.real}: {found["faults"]} of {TICKS - WARM_UP} steps are not ordinary ones')
        for what, key in (('flash', 'flash_bytes'), ('stack', 'stack_bytes'), ('instructions', 'instructions')):
            if key not in estimated:
                line += f' {"":9} {"":9} {"":6}'
                continue
            error = estimated[key] / found[what] - 1.0
            largest[what] = max(largest.get(what, 0.0), abs(error))
            line += f' {found[what]:9.0f} {estimated[key]:9.0f} {100.0 * error:+6.1f}'
            if abs(error) > LARGEST_ERROR:
                failures.add(f'{label} {program.real} on {target.name}: {what} estimated {100.0 * error:+.1f} % off')
        return line

    text = line_of(program.label, own, estimate) + f' {own["state"]:6}'
    if program.model.controller:
        text += '\n' + line_of(f'{program.label}, loop', own['control'], estimate['control'])
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--torsio', type=pathlib.Path, required=True, help='the program of a build')
    parser.add_argument('--folder', type=pathlib.Path, required=True, help='for models, programs and measurements')
    parser.add_argument('--fit', action='store_true', help='only measure, and print the constants of c_cost.cpp')
    parser.add_argument('--write', action='store_true', help='with --fit: write them into src/export/c_cost.cpp')
    parser.add_argument('--only', nargs='+', default=[], help='names of models')
    flags = parser.parse_args()
    flags.torsio, flags.folder = flags.torsio.resolve(), flags.folder.resolve()
    os.environ['LC_ALL'] = 'C'
    workshop = Workshop(flags.torsio, flags.folder)
    if flags.fit:
        import fit_costs  # needs scipy
        return fit_costs.fit(workshop, flags, TARGETS, exported, measured)
    failures = Failures()
    models = [model for model in MODELS if model.is_held_out and (not flags.only or model.name in flags.only)]
    print('self-tests (largest difference from torsio, as a share of the torque range) and hosts')
    print(f'{"model":26} {"real":6} {"host":>9} {"wasm":>6} {"mex":>6}  self-test in qemu, with wrong constants')
    programs = list(programs_of(workshop, models))
    for program in programs:
        check_compilers(program, failures)
        cells = [check_host(program, workshop, failures)]
        cells += [check_wasm(program, failures), check_mex(program, failures)]
        on_targets = [f'{target.name} {" ".join(check_target(program, target, failures))}' for target in TARGETS
                      if program.real in target.reals]
        print(f'{program.label:26} {program.real:6} {cells[0]:>9} {cells[1]:>6} {cells[2]:>6}  {", ".join(on_targets)}',
              flush=True)
    print('\nmeasured and estimated; flash without the functions of a compiler, stack of the deepest chain of calls')
    print(f'{"model":26} {"family":20} {"target":10} {"real":6} {"flash":>9} {"estimate":>9} {"%":>6} {"stack":>9} '
          f'{"estimate":>9} {"%":>6} {"instr.":>9} {"estimate":>9} {"%":>6} {"state":>6}')
    largest = {}
    for program in programs:
        for target in TARGETS:
            if program.real in target.reals:
                print(compare(program, target, workshop, failures, largest), flush=True)
    print('largest errors: ' + ', '.join(f'{what} {100.0 * error:.1f} %' for what, error in largest.items()))
    if not flags.only:
        print_reach(workshop)
    if failures.texts:
        print(f'\n{len(failures.texts)} failures:')
        for text in failures.texts:
            print(text)
    return 1 if failures.texts else 0


def print_reach(workshop):
    """The shape for which the export was planned, and how much of its cost are the guards and the pipeline."""
    target = TARGETS[0]
    by_name = {model.name: model for model in MODELS}
    own = {name: measured(exported(workshop, by_name[name], 'float', False), target, workshop) for name in
           (REACH.linear, REACH.plain, REACH.residual, REACH.bank)}
    print('\na grey_box with 33 knots and 8 slips of 5 knots, that of torsio demo, on Cortex-M4F as float')
    print(f'{"":52} {"instructions":>12} {"flash":>7}')

    def line(what, instructions, flash, limits=''):
        print(f'{what:52} {instructions:12.0f} {flash:7.0f}  {limits}')

    def whole(what, name, limits=''):
        line(what, own[name]['instructions'], own[name]['flash'], limits)

    def difference(what, name, other, limits=''):
        line(what, own[name]['instructions'] - own[other]['instructions'], own[name]['flash'] - own[other]['flash'], limits)

    whole('pipeline and guards, with a linear model', REACH.linear)
    whole('all, without a residual', REACH.plain)
    difference('of these, the grey_box: more than the linear model', REACH.plain, REACH.linear, 'aim: 700 instructions, 2.5 kB')
    difference('a bank over another input: more', REACH.bank, REACH.plain)
    whole('all, with a network 11-16-16-1', REACH.residual)
    difference('of these, the grey_box: more than the linear model', REACH.residual, REACH.linear, 'aim: 5200 instructions, 5 kB')


if __name__ == '__main__':
    sys.exit(main())
