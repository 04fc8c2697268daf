% A genetic algorithm: nlp-gait compare nao-ssp --algorithms 'cmd:octave-cli --quiet genetic.m' (MATLAB: see docs/researcher.md)
1;
function cost = evaluate(X)  % one number for each row of X, less is better; ends the program when the run is over
  rows = sprintf(['[' strjoin(repmat({'%.17g'}, 1, columns(X)), ',') '],'], X');
  printf('{"x": [%s]}\n', rows(1:end-1));
  fflush(stdout);
  answer = jsondecode(input('', 's'));
  if isfield(answer, 'stop'), exit(0); end
  cost = answer.cost(:);
end
problem = jsondecode(input('', 's'));
lower = problem.lower(:)'; upper = problem.upper(:)'; n = numel(lower); P = 40;
rand('twister', problem.seed); randn('twister', problem.seed);
X = lower + rand(P, n) .* (upper - lower);
cost = evaluate(X);
while true
  a = randi(P, P, 2); b = randi(P, P, 2);  % tournaments of two
  first = a(sub2ind([P 2], (1:P)', 1 + (cost(a(:, 2)) < cost(a(:, 1)))));
  second = b(sub2ind([P 2], (1:P)', 1 + (cost(b(:, 2)) < cost(b(:, 1)))));
  w = rand(P, n);
  child = w .* X(first, :) + (1 - w) .* X(second, :) + (rand(P, n) < 1 / n) .* randn(P, n) .* (upper - lower) * 0.1;
  child = min(max(child, lower), upper);
  value = evaluate(child);
  [cost, order] = sort([cost; value]); cost = cost(1:P);
  X = [X; child](order(1:P), :);
end
