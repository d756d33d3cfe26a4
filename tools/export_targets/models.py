"""The models that are exported: those held out are checked by `./run long export`; the others are for the fit of prices."""
import dataclasses

# Arguments of `torsio simulate`, and a column that is added.
RECORDINGS = {
    'sweep_1': ('dfki-50 sweep --duration 40s --seed 1', None),
    'sweep_2': ('dfki-50 sweep --duration 20s --seed 2', None),
    # Those of torsio demo.
    'demo_1': ('dfki-50 sweep --lever 0.1m --seed 1', None),
    'demo_2': ('dfki-50 sweep --lever 0.17m --seed 2', None),
    'demo_3': ('dfki-50 sweep --lever 0.24m --seed 3', None),
    'demo_4': ('dfki-50 sweep --lever 0.29m --inclination 37.8deg --seed 4', None),
    'cold': ('dfki-50 sweep --duration 20s --seed 3 --temperature 0degC', ('support_m', '0.1')),
    'warm': ('dfki-50 sweep --duration 20s --seed 4 --temperature 30degC', ('support_m', '0.2')),
    'hot': ('dfki-50 sweep --duration 20s --seed 5 --temperature 60degC', ('support_m', '0.3')),
    'pushed_1': ('harmonic-drive human-torque --seed 1', None),
    'pushed_2': ('harmonic-drive human-torque --seed 2 --impedance zero', None),
    'pushed_3': ('harmonic-drive human-torque --seed 3', None),
}

# Arguments of `torsio tune-loop`, and what is replaced in its file: no stop, a drive that follows a speed.
LIMITS = '--actuator dfki-50 --bandwidth 8Hz --lowest-angle=-90deg --highest-angle 90deg'
CONTROLLERS = {
    'whole': (LIMITS, None),
    'observer': (f'{LIMITS} --observer 8Hz', None),
    'without_stop': (LIMITS, (r'(?s)stop:\n.*?(?=^\w)', '')),
    'speed': (LIMITS, ('actuation: current', 'actuation: velocity')),
}


@dataclasses.dataclass(frozen=True)
class Model:
    name: str
    family: str
    settings: str = ''
    inputs: str = ''
    is_held_out: bool = False
    counts: tuple = ()  # channels that are also given as counts
    recordings: tuple = ('sweep_1',)
    drive: str = 'sweep_2'  # the recording over which instructions are counted
    first_row: int = 3000
    controller: str = ''
    target: str = 'torque_Nm'


SPRING = 'gear_angle_rad - joint_angle_rad'
RATE = f'lowpass(rate({SPRING}), 10Hz)'
SPEED = 'lowpass(rate(joint_angle_rad), 20Hz)'
TWO = f'{SPRING}, {RATE}'
THREE = f'{SPRING}, {RATE}, {SPEED}'
HARMONIC = 'motor_angle_rad / 2 - wave_generator_angle_rad'
PUSHED = f'{HARMONIC}, motor_torque_Nm, lowpass(rate(wave_generator_angle_rad), 10Hz)'
DEMO = ('demo_1', 'demo_2', 'demo_3')
BOTH = ('gear_angle_rad', 'joint_angle_rad')


def fitted(name, family, settings='', inputs=TWO, **options):
    return Model(name, family, settings, inputs, **options)


def held(name, family, settings='', inputs=TWO, **options):
    return Model(name, family, settings, inputs, is_held_out=True, **options)


def pushed(model):
    """The same on recordings of the actuator with a harmonic drive."""
    return dataclasses.replace(model, inputs=PUSHED, recordings=('pushed_1', 'pushed_2'), drive='pushed_3', first_row=1000)


def controlled(controller, model):
    """With the controller of its joint, whose deflection is an input of the model."""
    return dataclasses.replace(model, controller=controller, inputs=model.inputs.replace(SPRING, 'spring_deflection_rad'),
                               counts=('motor_angle_rad', *BOTH) if model.counts else ())


def of_deflection(name, family, settings='', **options):
    """A model that is the inverse of the spring by itself."""
    return Model(name, family, settings, 'torque_Nm, lowpass(rate(torque_Nm), 10Hz)', target='spring_deflection_rad',
                 **options)


def scheduled(model):
    return dataclasses.replace(model, settings=(model.settings + ' schedule=support_m').strip(),
                               inputs=model.inputs + ', support_m', recordings=('cold', 'warm', 'hot'), drive='warm')


FEW = 'epochs=2 '
MODELS = [
    fitted('linear_1', 'linear', '', SPRING),
    fitted('linear_3', 'linear', '', THREE, counts=BOTH),
    fitted('linear_operations', 'linear', '',
           f'{SPRING}, rate(joint_angle_rad), lag(joint_angle_rad, 2), joint_angle_rad * gear_angle_rad, '
           'joint_angle_rad + 0.1, abs(joint_angle_rad)'),
    fitted('linear_filters', 'linear', '',
           f'{SPRING}, lowpass(joint_angle_rad, 5Hz), lowpass(joint_angle_rad, 8Hz), lowpass(joint_angle_rad, 12Hz), '
           'lowpass(gear_angle_rad, 5Hz)'),
    fitted('linear_functions', 'linear', '',
           f'{SPRING}, sin(joint_angle_rad), cos(joint_angle_rad), exp(joint_angle_rad), sqrt(abs(joint_angle_rad))'),
    fitted('linear_tangents', 'linear', '',
           f'{SPRING}, atan(joint_angle_rad), tanh(joint_angle_rad), (1.5 + 0.1 * joint_angle_rad) ^ 1.5, joint_angle_rad ^ 3'),
    fitted('linear_lags', 'linear', '',
           f'{SPRING}, rate(joint_angle_rad), rate(gear_angle_rad), lag(gear_angle_rad, 5), lag(joint_angle_rad, 7)'),
    # Short distances, so that the unknown start has decayed before instructions are counted.
    fitted('linear_history', 'linear', '', f'{SPRING}, stop({SPRING}, 0.2mrad), dahl({SPRING}, 0.1mrad)'),
    fitted('linear_stops', 'linear', '', f'{SPRING}, stop({SPRING}, 0.1mrad), stop({SPRING}, 0.2mrad)'),
    fitted('linear_dahl', 'linear', '', f'{SPRING}, dahl({SPRING}, 0.1mrad)'),
    held('linear_dahl_2', 'linear', '', f'{SPRING}, dahl({SPRING}, 0.2mrad), dahl({SPRING}, 0.05mrad)'),
    scheduled(fitted('linear_scheduled', 'linear', '', TWO)),
    scheduled(fitted('linear_two_scheduled', 'linear', '', f'{SPRING}, joint_angle_rad')),
    scheduled(fitted('linear_gear_scheduled', 'linear', '', 'gear_angle_rad')),
    scheduled(held('linear_1_scheduled', 'linear', '', SPRING)),
    held('linear_2', 'linear', counts=BOTH),
    held('linear_mixed', 'linear', '',
         f'{SPRING}, lowpass({SPRING}, 10Hz), sin(joint_angle_rad), lag(joint_angle_rad, 3), exp(0.2 * joint_angle_rad) + 1'),
    pushed(held('linear_pushed', 'linear')),
    held('linear_stop', 'linear', '', f'{SPRING}, stop({SPRING}, 0.3mrad)'),

    fitted('coulomb_2', 'linear_coulomb'),
    pushed(fitted('coulomb_pushed', 'linear_coulomb')),
    held('coulomb_3', 'linear_coulomb', '', THREE, counts=BOTH),

    fitted('polynomial_3', 'polynomial', 'degree=3 branch=false', SPRING),
    fitted('polynomial_9', 'polynomial', 'degree=9 branch=false', TWO),
    fitted('polynomial_5_branch', 'polynomial', 'degree=5'),
    fitted('polynomial_9_branch', 'polynomial', 'degree=9', THREE),
    scheduled(fitted('polynomial_scheduled', 'polynomial', 'degree=3 branch=false', SPRING)),
    scheduled(fitted('polynomial_5_scheduled', 'polynomial', 'degree=5 branch=false', SPRING)),
    held('polynomial_6', 'polynomial', 'degree=6 branch=false', TWO),
    held('polynomial_7_branch', 'polynomial', 'degree=7', THREE),

    fitted('maxwell_2', 'maxwell_slip', 'thresholds=2'),
    fitted('maxwell_16', 'maxwell_slip', 'thresholds=16', THREE, counts=BOTH),
    pushed(fitted('maxwell_pushed', 'maxwell_slip')),
    scheduled(fitted('maxwell_scheduled', 'maxwell_slip', 'thresholds=6', SPRING)),
    held('maxwell_8', 'maxwell_slip', '', TWO, counts=BOTH),
    scheduled(held('maxwell_4_scheduled', 'maxwell_slip', 'thresholds=4', TWO)),

    fitted('prandtl_4', 'prandtl_ishlinskii', 'thresholds=4', SPRING),
    fitted('prandtl_12', 'prandtl_ishlinskii', 'thresholds=12', TWO),
    held('prandtl_8', 'prandtl_ishlinskii', '', TWO),

    fitted('viscoelastic_003a', 'viscoelastic', 'network=003a starts=2', SPRING),
    fitted('viscoelastic_003c', 'viscoelastic', 'network=003c starts=2', SPRING),
    fitted('viscoelastic_5', 'viscoelastic', 'network=generalised_maxwell(5) starts=2', SPRING),
    held('viscoelastic_3', 'viscoelastic', 'network=generalised_maxwell(3) starts=2', SPRING),

    fitted('hammerstein', 'hammerstein_wiener', 'structure=given', SPRING),
    fitted('hammerstein_knots', 'hammerstein_wiener', 'structure=given map=piecewise_linear knots=7', SPRING),
    fitted('hammerstein_poles', 'hammerstein_wiener', 'structure=given zeros=2 poles=4 iterations=3000', SPRING),
    held('hammerstein_3', 'hammerstein_wiener', 'structure=given zeros=1 poles=3 iterations=3000', SPRING),

    fitted('mlp_8', 'mlp', FEW + 'layers=8 activation=tanh'),
    fitted('mlp_32', 'mlp', FEW + 'layers=32 activation=tanh', SPRING),
    fitted('mlp_32-16', 'mlp', FEW + 'layers=32-16 activation=tanh', THREE),
    fitted('mlp_16-16_relu', 'mlp', FEW + 'layers=16-16 activation=relu', THREE),
    fitted('mlp_elu', 'mlp', FEW + 'layers=12 activation=elu', TWO),
    held('mlp_16-16', 'mlp', FEW + 'layers=16-16 activation=tanh', TWO, counts=BOTH),
    held('mlp_24_relu', 'mlp', FEW + 'layers=24 activation=relu', TWO),
    held('mlp_50-20-10', 'mlp', FEW + 'layers=50-20-10', THREE),

    pushed(fitted('gru_8', 'gru', 'epochs=1 layers=8')),
    pushed(fitted('gru_24', 'gru', 'epochs=1 layers=24')),
    pushed(held('gru_16', 'gru', 'epochs=1 layers=16')),
    pushed(fitted('lstm_8', 'lstm', 'epochs=1 layers=8')),
    pushed(fitted('lstm_16-8', 'lstm', 'epochs=1 layers=16-8')),
    pushed(held('lstm_24', 'lstm', 'epochs=1 layers=24')),

    fitted('grey_box_1', 'grey_box', 'residual=none banks=false', SPRING),
    fitted('grey_box_2', 'grey_box', 'residual=none banks=false', TWO, counts=BOTH),
    fitted('grey_box_mlp', 'grey_box', 'residual=mlp banks=false', TWO),
    fitted('grey_box_banks', 'grey_box', 'residual=none', THREE, recordings=DEMO, drive='demo_4'),
    pushed(fitted('grey_box_pushed', 'grey_box', 'residual=none')),
    scheduled(fitted('grey_box_scheduled', 'grey_box', 'residual=none', TWO)),
    held('grey_box_3', 'grey_box', 'residual=none banks=false', THREE),
    pushed(held('grey_box_pushed_mlp', 'grey_box', 'residual=mlp')),

    fitted('gp_7', 'parametric_gp', 'inducing_points=7 updates=500'),
    fitted('gp_se', 'parametric_gp', 'kernel=se updates=500'),
    fitted('gp_matern32', 'parametric_gp', 'kernel=linear_ard+matern32_ard inducing_points=10 updates=500', THREE),
    fitted('gp_rq', 'parametric_gp', 'kernel=rq*linear inducing_points=10 updates=500', THREE),
    fitted('gp_matern52', 'parametric_gp', 'kernel=matern52 inducing_points=30 updates=500', SPRING),
    fitted('gp_periodic', 'parametric_gp', 'kernel=se+periodic inducing_points=20 updates=500', TWO),
    held('gp_14', 'parametric_gp', 'updates=500', TWO),
    held('gp_20_se', 'parametric_gp', 'kernel=se_ard inducing_points=20 updates=500', THREE),
    held('gp_12_matern', 'parametric_gp', 'kernel=linear_ard+matern52_ard inducing_points=12 updates=500', TWO),

    controlled('whole', fitted('control_linear', 'linear', '', TWO, counts=BOTH)),
    controlled('without_stop', fitted('control_coulomb', 'linear_coulomb')),
    controlled('observer', fitted('control_polynomial', 'polynomial', 'degree=5')),
    controlled('whole', fitted('control_maxwell', 'maxwell_slip', 'thresholds=12', SPRING)),
    controlled('speed', fitted('control_prandtl', 'prandtl_ishlinskii', 'thresholds=4')),
    controlled('whole', fitted('control_viscoelastic', 'viscoelastic', 'network=generalised_maxwell(3) starts=2', SPRING)),
    controlled('whole', fitted('control_grey_box', 'grey_box', 'residual=none banks=false', TWO, counts=BOTH)),
    controlled('speed', fitted('control_grey_box_mlp', 'grey_box', 'residual=mlp banks=false', THREE)),
    controlled('without_stop', fitted('control_grey_box_line', 'grey_box', 'residual=none banks=false', SPRING)),
    controlled('observer', of_deflection('control_deflection_line', 'linear')),
    controlled('speed', of_deflection('control_deflection_mlp', 'mlp', FEW + 'layers=16 activation=tanh')),
    controlled('whole', held('control_coulomb_3', 'linear_coulomb', '', THREE, counts=BOTH)),
    controlled('observer', held('control_maxwell_8', 'maxwell_slip', '', TWO)),
    controlled('whole', held('control_polynomial_7', 'polynomial', 'degree=7 branch=false', TWO)),
    controlled('speed', held('control_grey_box_2', 'grey_box', 'residual=none banks=false', TWO)),
    controlled('whole', held('control_grey_box_3', 'grey_box', 'residual=mlp banks=false', THREE, counts=BOTH)),
    controlled('whole', dataclasses.replace(of_deflection('control_deflection_gru', 'gru', 'epochs=20 layers=8'), is_held_out=True)),

    # The shape of the plan; its inputs are those that torsio takes by itself.
    held('reach_linear', 'linear', '', '', recordings=DEMO, drive='demo_4'),
    held('reach', 'grey_box', 'residual=none banks=false', '', recordings=DEMO, drive='demo_4', counts=BOTH),
    held('reach_mlp', 'grey_box', 'residual=mlp banks=false', '', recordings=DEMO, drive='demo_4'),
    held('reach_banks', 'grey_box', 'residual=none', '', recordings=DEMO, drive='demo_4'),
]


class REACH:
    linear = 'reach_linear'
    plain = 'reach'
    residual = 'reach_mlp'
    bank = 'reach_banks'
