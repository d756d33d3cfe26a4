% Golden values of Octave's control package for control_golden_test.cpp. `./run oracles` runs this in its own folder.
%
% A deflection loop on a spring, opened at the current: PID with a low-passed derivative, one sample of delay, a hold,
% and rotor, current loop, spring and joint. The file contains the inputs; results are rounded, so that every machine
% writes the same bytes.
pkg load control

function value = rounded(value)
  value = str2double(sprintf('%.6g', value));
end

function found = zero_crossings(f, grid, values)
  found = [];
  for k = find(sign(values(1:end-1)(:)) ~= sign(values(2:end)(:)))'
    found(end + 1) = fzero(f, grid(k:k+1), optimset('TolX', 1e-10));
  end
end

function result = case_of(c)
  T = 1 / c.sample_rate_Hz;
  J = c.rotor_inertia_kg_m2 * c.ratio^2;
  torque = c.ratio * c.torque_constant_Nm_A;
  % States: deflection, motor-side speed, current; with a free output its speed besides.
  A = [0 1 0; -c.stiffness_Nm_rad/J -c.viscous_Nms_rad/J torque/J; 0 0 -1/c.current_time_constant_s];
  B = [0; 0; 1/c.current_time_constant_s];
  C = [1 0 0];
  if c.is_free
    A = [A [-1; 0; 0]; c.stiffness_Nm_rad/c.joint_inertia_kg_m2 0 0 -c.joint_viscous_Nms_rad/c.joint_inertia_kg_m2];
    B = [B; 0];
    C = [C 0];
  end
  plant = c2d(ss(A, B, C, 0), T, 'zoh');
  z = tf('z', T);
  w = 2 * pi * c.cutoff_Hz;
  lowpass = c2d(tf(w^2, [1 sqrt(2)*w w^2]), T, 'prewarp', w);
  controller = c.proportional + c.integral * T / (z - 1) + c.derivative * lowpass * (z - 1) / (T * z);
  loop = minreal(ss(controller)) * plant * ss(tf(1, [1 0], T));
  % margin() goes through polynomials, which lose too many digits at this order to find the crossover: its
  % freqresp() is exact, and the crossings are looked for in that.
  response = @(w) squeeze(freqresp(loop, w));
  grid = logspace(0, log10(pi / T), 4000);
  values = response(grid);
  crossovers = zero_crossings(@(w) abs(response(w)) - 1, grid, abs(values) - 1);
  [phase, k] = min(abs(arg(-arrayfun(response, crossovers))));
  reals = zero_crossings(@(w) imag(response(w)), grid, imag(values));
  gains = -1 ./ real(arrayfun(response, reals));
  reals = reals(gains >= 1);
  gains = gains(gains >= 1);
  [gain, m] = min(gains);
  result = c;
  result.radius = rounded(max(abs(eig(feedback(loop)))));
  result.gain = rounded(gain);
  result.gain_rad_s = rounded(reals(m));
  result.phase_deg = rounded(phase * 180 / pi);
  result.crossover_rad_s = rounded(crossovers(k));
  result.frequencies_rad_s = [1 20 100 300 1000 3000];
  [re, im] = deal(zeros(1, 6));
  for k = 1:6
    value = response(result.frequencies_rad_s(k));
    re(k) = rounded(real(value));
    im(k) = rounded(imag(value));
  end
  result.real = re;
  result.imag = im;
end

base = struct('sample_rate_Hz', 1000, 'rotor_inertia_kg_m2', 6e-5, 'ratio', 120, 'torque_constant_Nm_A', 0.104, ...
              'stiffness_Nm_rad', 573, 'viscous_Nms_rad', 10, 'current_time_constant_s', 5e-4, ...
              'joint_inertia_kg_m2', 0.15, 'joint_viscous_Nms_rad', 0.05, 'cutoff_Hz', 120, ...
              'proportional', 127, 'integral', 762, 'derivative', 6.2, 'is_free', false);
cases = {};
for is_free = [false true]
  c = base;
  c.is_free = is_free;
  cases{end + 1} = case_of(c);
  c.sample_rate_Hz = 2000;
  c.proportional = 400;
  c.derivative = 12;
  cases{end + 1} = case_of(c);
  c = base;
  c.is_free = is_free;
  c.rotor_inertia_kg_m2 = 3e-4;
  c.ratio = 160;
  c.torque_constant_Nm_A = 0.21;
  c.stiffness_Nm_rad = 2250;
  c.viscous_Nms_rad = 60;
  c.proportional = 500;
  c.integral = 0;
  c.derivative = 20;
  cases{end + 1} = case_of(c);
end
file = fopen('control.json', 'w');
fprintf(file, '%s\n', strrep(jsonencode(cases), '},{', sprintf('},\n{')));
fclose(file);
