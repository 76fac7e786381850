//! Enumerations that cross process borders as `u32`.
//!
//! A number that none of the names has comes back as `None`: the sender is newer than the receiver, or broken.

/// An enumeration for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// Number, name and meaning of each code.
    pub rows: &'static [(u32, &'static str, &'static str)],
}

/// All enumerations.
pub const TABLES: [Table; 10] = [
    Process::TABLE,
    State::TABLE,
    Reason::TABLE,
    Outcome::TABLE,
    Limit::TABLE,
    Mode::TABLE,
    Order::TABLE,
    ContactState::TABLE,
    Fall::TABLE,
    PhaseKind::TABLE,
];

macro_rules! codes {
    ($(#[doc = $doc:literal])* $name:ident {
        $($(#[doc = $variant_doc:literal])* $variant:ident = $code:literal, $word:literal;)*
    }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[doc = $variant_doc])* $variant,)*
        }

        impl $name {
            /// All of them, in the order of their codes.
            pub const ALL: &[$name] = &[$($name::$variant,)*];

            /// What they mean, for people.
            pub const TABLE: Table = Table {
                name: stringify!($name),
                doc: concat!($($doc, "\n",)*),
                rows: &[$(($code, stringify!($variant), concat!($($variant_doc, "\n",)*)),)*],
            };

            /// The number that crosses the process border.
            pub const fn code(self) -> u32 {
                match self { $($name::$variant => $code,)* }
            }

            /// The name of a number, if it has one.
            pub const fn from_code(code: u32) -> Option<Self> {
                match code { $($code => Some($name::$variant),)* _ => None }
            }

            /// A word for people.
            pub const fn word(self) -> &'static str {
                match self { $($name::$variant => $word,)* }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }
    };
}

codes! {
    /// The processes.
    Process {
        /// Plans the walk.
        Planner = 1, "planner";
        /// Estimates the deformation of the soles.
        Estimator = 2, "estimator";
        /// Tracks pattern and ankle poses with the whole body.
        Controller = 3, "controller";
        /// The simulated robot.
        Simulator = 4, "simulator";
        /// Writes every topic to a file.
        Recorder = 5, "recorder";
        /// Starts and supervises the others.
        Launcher = 6, "launcher";
    }
}

codes! {
    /// What a process is doing.
    State {
        /// Reading its configuration, building its models.
        Starting = 1, "starting";
        /// Waiting for the others.
        Ready = 2, "ready";
        /// At work.
        Running = 3, "running";
        /// Alive, but in its safe behaviour (holding posture, last good value).
        Holding = 4, "holding";
        /// About to end, or done.
        Stopping = 5, "stopping";
    }
}

codes! {
    /// Why a process is in its state.
    Reason {
        /// Nothing special.
        None = 0, "";
        /// The walk is over.
        Finished = 1, "finished";
        /// The robot has fallen.
        Fallen = 2, "fallen";
        /// An input stayed away.
        InputMissing = 3, "input missing";
        /// A solver failed too often.
        SolverFailed = 4, "solver failed";
        /// The plan cannot be met.
        Infeasible = 5, "infeasible";
        /// Asked to stop (signal).
        Asked = 6, "asked to stop";
        /// A message of another robot arrived.
        OtherRobot = 7, "message of another robot";
        /// Deadlines were missed too often.
        Deadline = 8, "deadlines missed";
        /// The disk is full or too slow.
        Storage = 9, "storage failed";
        /// The pattern is of another version, too long or damaged.
        PatternRefused = 10, "pattern refused";
        /// The robot did not come to stand still: the walk was not begun.
        NotSettled = 11, "did not settle";
    }
}

codes! {
    /// Outcome of a computation.
    Outcome {
        /// Nothing was computed.
        None = 0, "none";
        /// Solved to tolerance.
        Solved = 1, "solved";
        /// The iteration limit was reached; the residual says how far it came.
        IterationLimit = 2, "iteration limit";
        /// The problem has no solution.
        Infeasible = 3, "infeasible";
        /// Broken numbers.
        NumericalFailure = 4, "numerical failure";
        /// The reference asks for what the contact cannot give (zero-moment point outside the sole, force outside the cone).
        ReferenceOutside = 5, "reference outside";
        /// An older value is used in its place.
        Held = 6, "held";
        /// Solved to tolerance with limits widened that excluded each other.
        Relaxed = 7, "relaxed";
    }
}

codes! {
    /// Limits of the controller that may give way where they exclude each other, from the first to give way to the last.
    Limit {
        /// None gave way.
        None = 0, "none";
        /// Load of a foot (N).
        Load = 1, "load of foot";
        /// Acceleration of two bodies towards each other (m/s^2).
        Collision = 2, "approach of collision pair";
        /// Acceleration of a joint near the limits of its position and speed (rad/s^2).
        JointMotion = 3, "motion of joint";
        /// Torque of a joint (N m).
        Torque = 4, "torque of joint";
        /// Acceleration of a standing ankle away from the estimator's (m/s^2, rad/s^2).
        Contact = 5, "motion of standing ankle";
    }
}

codes! {
    /// What the controller does.
    Mode {
        /// Holding the posture before the walk.
        Standing = 1, "standing";
        /// Walking.
        Walking = 2, "walking";
        /// Holding the posture after the walk.
        Finished = 3, "finished";
        /// Holding the posture because something failed.
        Holding = 4, "holding";
    }
}

codes! {
    /// The operator's word.
    Order {
        /// None was given.
        None = 0, "none";
        /// Walk off, as soon as the robot stands still.
        Start = 1, "start";
        /// Complete the step under way and stand.
        Stop = 2, "stop";
    }
}

codes! {
    /// What a node of the sole does.
    ContactState {
        /// No force.
        Open = 0, "open";
        /// Force inside the friction cone, no motion along the ground.
        Stick = 1, "stick";
        /// Force on the cone, motion against it.
        Slip = 2, "slip";
    }
}

codes! {
    /// Why the robot counts as fallen.
    Fall {
        /// It stands.
        None = 0, "none";
        /// The base is too low.
        BaseLow = 1, "base too low";
        /// The trunk is tilted too far.
        Tilted = 2, "tilted too far";
        /// A part other than the soles touches the ground.
        BodyContact = 3, "body touches the ground";
        /// The simulation broke down.
        Diverged = 4, "simulation diverged";
    }
}

codes! {
    /// Which part of the walk a phase belongs to.
    PhaseKind {
        /// Double support before the first step.
        Start = 0, "start";
        /// One foot in the air.
        SingleSupport = 1, "single support";
        /// Load goes from one foot to the other.
        DoubleSupport = 2, "double support";
        /// Double support after the last step.
        Stop = 3, "stop";
    }
}
