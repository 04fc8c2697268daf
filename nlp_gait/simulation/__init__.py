"""Simulation of planned gaits in MuJoCo, a physics engine that shares no formula with the model (extra ``sim``)."""
