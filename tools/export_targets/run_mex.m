% Runs a program as a MEX file over inputs.bin: its self-test must pass, and each number equal that of the host's program.
% octave run_mex.m FOLDER TOLERANCE
folder = argv(){1};
tolerance = str2double(argv(){2});
addpath(folder);
apart = joint();
if !(apart < tolerance)
  error("the self-test is %g off", apart);
end
file = fopen([folder "/outputs.bin"]);
expected = fread(file, [3 Inf], "double");
fclose(file);
ticks = columns(expected);
file = fopen([folder "/inputs.bin"]);
raw = fread(file, [Inf], "double");
fclose(file);
out = joint(reshape(raw, [], ticks));
if !isequaln(out, expected)
  error("the largest difference is %g", max(max(abs(out - expected))));
end
printf("self-test %.3g, %d ticks equal\n", apart, ticks);
