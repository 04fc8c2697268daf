# nlp-gait compare nao-ssp --algorithms 'cmd:Rscript random_search.R' (package jsonlite)
library(jsonlite)
input <- file("stdin", "r")
problem <- fromJSON(readLines(input, 1))
set.seed(problem$seed)
n <- length(problem$lower)
repeat {
  points <- t(replicate(100, runif(n, problem$lower, problem$upper)))
  cat(toJSON(list(x = points), digits = NA), "\n", sep = "")
  flush(stdout())
  answer <- fromJSON(readLines(input, 1))  # f, violation and cost of each point
  if (!is.null(answer$stop)) break
}
