//! All memory of the algorithms.

use crate::coupled::{self, Coupled};
use crate::model::Model;
use crate::tree::memory;
use nalgebra::DVector;

/// All memory of the algorithms, made once per model. What they compute is in what they return.
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(crate) tree: memory::Memory,
    /// Generalised forces of a refinement, and the accelerations before it.
    pub(crate) forces: DVector<f64>,
    pub(crate) unrefined: DVector<f64>,
    /// Only where joints follow others.
    coupled: Option<Box<coupled::Memory>>,
}

impl Workspace {
    /// Memory for a model's algorithms; frames may be added to the model afterwards.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            tree: memory::Memory::new(model),
            forces: DVector::zeros(model.nv()),
            unrefined: DVector::zeros(model.nv()),
            coupled: model.coupling.as_ref().map(|_| Box::new(coupled::Memory::new(model))),
        }
    }

    /// The memory of the recursions; and how the robot's joints follow others, if some do.
    pub(crate) fn parts<'a>(&'a mut self, model: &'a Model) -> (&'a mut memory::Memory, Option<Coupled<'a>>) {
        let coupled = model.coupling.as_ref().map(|coupling| {
            let memory = self.coupled.as_mut().expect("a workspace is used with the model that it was made for");
            Coupled { model, coupling, memory }
        });
        (&mut self.tree, coupled)
    }
}
