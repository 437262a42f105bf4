"""Plots a flight: replay export flight.mcap --out tables; python3 plot.py tables plot.png"""
import sys
import matplotlib
import pandas

matplotlib.use("Agg")  # draws into a file, without a window
tables, picture = sys.argv[1:]
flight = pandas.read_csv(f"{tables}/pilot_estimate.csv")
columns = ["state.position_m.z", "state.velocity_m_s.z", "motor.impulse_scale"]
axes = flight.plot(x="time_s", y=columns, subplots=True, grid=True, xlabel="T+ [s]")
axes[0].figure.savefig(picture)
