//! Convex quadratic programs, solver-neutral, with Clarabel behind them.
