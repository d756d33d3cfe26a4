% Hammerstein-Wiener by simulation error with Octave's optim: the same samples, numbers and scaling as ours.
% Usage: octave-cli --no-gui peer_hammerstein_wiener.m FOLDER
% Prints the seconds of the fastest of its methods that reaches our error, from a simple start: time constants of
% a tenth of a second and one second, linear curves. The time from our start is printed on stderr.
warning ("off", "all");
pkg load optim
1;

function values = read (folder, name)
  file = fopen (fullfile (folder, [name ".f64"]));
  values = fread (file, Inf, "double");
  fclose (file);
end

function y = simulated (p, z, rest, frame)
  w = z + p(1) * z .^ 2 - (rest + p(1) * rest ^ 2);
  x = filter ([1 p(2)], [1 p(3) p(4)], w);
  s = (x - frame(4)) / frame(5);
  y = p(5) + s .* (p(6) + s .* (p(7) + s .* p(8)));
end

folder = argv (){1};
u = read (folder, "input");
target = read (folder, "target");
frame = read (folder, "frame");
start = read (folder, "start");
answer = read (folder, "answer");
z = (u - frame(1)) / frame(2);
rest = (frame(3) - frame(1)) / frame(2);
model = @(ignored, p) simulated (p, z, rest, frame);
rmse = @(p) sqrt (mean ((model (z, p) - target) .^ 2));

x = filter ([1 -0.9], conv ([1 -exp(-0.05)], [1 -exp(-0.005)]), z - rest);
slope = [ones(size (x)) (x - frame(4)) / frame(5)] \ target;
plain = [0; -0.9; conv([1 -exp(-0.05)], [1 -exp(-0.005)])(2:3)'; slope; 0; 0];

denominator = conv ([1 -exp(-0.05)], [1 -exp(-0.005)]);
x = filter ([1 -0.9], denominator, z - rest);
slope = [ones(size (x)) (x - frame(4)) / frame(5)] \ target;
plain = [0; -0.9; denominator(2); denominator(3); slope; 0; 0];

best = Inf;
options = optimset ("TolFun", 1e-9, "MaxIter", 200);
for run = 1:2
  for from = {plain, start}
    tic ();
    p = lsqnonlin (@(p) model (z, p) - target, from{1}, [], [], options);
    spent = toc ();
    fprintf (stderr (), "lsqnonlin: %.3f s, RMSE %.6g (ours %.6g)\n", spent, rmse (p), answer);
    if (isequal (from{1}, plain) && rmse (p) <= 1.001 * answer) best = min (best, spent); end
  end
end
try
  tic ();
  [~, p] = leasqr (z, target, plain, model, 1e-9, 200);
  spent = toc ();
  fprintf (stderr (), "leasqr: %.3f s, RMSE %.6g\n", spent, rmse (p));
  if (rmse (p) <= 1.001 * answer) best = min (best, spent); end
catch failure
  fprintf (stderr (), "leasqr: %s\n", failure.message);
end
if (isinf (best)) error ("no method of Octave ends at our error"); end
printf ("%.9g\n", best);
