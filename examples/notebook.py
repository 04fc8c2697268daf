"""
In a notebook
=============

Time histories and runs become data frames, gaits become figures.
This page can be downloaded as a notebook.
"""
# sphinx_gallery_thumbnail_path = "images/nao-ssp-convergence.png"

import nlp_gait
from compare.study.record import make_frame
from compare.study.run import ProblemSpec, plan_runs
from compare.study.study import Study, run_study

# %%
# A solution has its variables by name, and the prices of its active bounds.

solution = nlp_gait.solve("nao-dsp", starts=2)
solution.x

# %%
# Time histories by name: arrays, or a pandas data frame whose index is time.

signals = solution.signals()
print(signals["tau LKneePitch"].max(), "Nm")
frame = signals.to_frame()
frame.iloc[:4, :4]

# %%
# The gait as a figure.

figure = solution.plot()
figure

# %%
# A study, and its runs as a data frame.

solvers = [("", "ipopt"), ("", "pso")]
study = Study(runs=plan_runs([ProblemSpec(name="nao-dsp")], solvers, runs=3, starts=3, evaluations=2000))
study

# %%
# Its records are a data frame, too.

records = run_study(study)
runs = make_frame(records)
runs.groupby("solver")[["objective", "calls_f", "time_s"]].median()
