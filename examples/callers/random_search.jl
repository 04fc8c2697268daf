# nlp-gait compare nao-ssp --algorithms 'cmd:julia random_search.jl' (package JSON)
using JSON, Random
problem = JSON.parse(readline())
lower, upper = Float64.(problem["lower"]), Float64.(problem["upper"])
Random.seed!(problem["seed"])
while true
    points = [lower .+ rand(length(lower)) .* (upper .- lower) for _ in 1:100]
    println(JSON.json(Dict("x" => points))); flush(stdout)
    answer = JSON.parse(readline())  # f, violation and cost of each point
    haskey(answer, "stop") && break
end
