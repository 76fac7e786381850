//! What is under a foot: an elastic sole or a hard plate, and what it last felt.

use sole::{ContactReport, ContactStatus, Ground, PoseDrivenContact, PoseDrivenSettings, SoleModel};
use spatial::{Mat6, Transform, Vec3};

use crate::corners::{ContactEvaluation, CornerContact, CornerSettings};
use crate::settings::ContactSettings;

/// The kind of sole under a foot.
#[derive(Debug, Clone)]
pub enum PlantSole {
    /// An elastic sole with exact Signorini-Coulomb contact (any level of the sole crate: full mesh, patches, ..).
    Elastic(Box<SoleModel>),
    /// Four stiff corners: the hard original foot, for reference.
    Corners(CornerSettings),
}

impl From<SoleModel> for PlantSole {
    fn from(model: SoleModel) -> Self {
        Self::Elastic(Box::new(model))
    }
}

impl From<CornerSettings> for PlantSole {
    fn from(settings: CornerSettings) -> Self {
        Self::Corners(settings)
    }
}

impl PlantSole {
    /// The foot link's origin in the sole frame (m).
    #[must_use]
    pub fn ankle_in_sole_m(&self) -> Vec3 {
        match self {
            Self::Elastic(model) => model.ankle_in_sole_m(),
            Self::Corners(settings) => Vec3::from(settings.ankle_in_sole_m),
        }
    }
}

/// Contact state of one foot.
pub(crate) enum Foot {
    Elastic(Box<PoseDrivenContact>),
    Corners(Box<CornerContact>),
}

impl Foot {
    pub fn new(sole: PlantSole, settings: &ContactSettings) -> Self {
        match sole {
            PlantSole::Corners(corners) => Self::Corners(Box::new(CornerContact::new(corners))),
            PlantSole::Elastic(model) => {
                let settings = PoseDrivenSettings {
                    tolerance: settings.tolerance,
                    viscosity_time_s: settings.viscosity_time_s,
                    ..PoseDrivenSettings::default()
                };
                Self::Elastic(Box::new(PoseDrivenContact::new(*model, settings)))
            }
        }
    }

    /// Wrench at a pose `dt_s` after the accepted state; may be tried at several poses.
    pub fn evaluate(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> ContactEvaluation {
        match self {
            Self::Elastic(contact) => {
                let report = contact.attempt(X_WS, ground, dt_s);
                ContactEvaluation {
                    wrench: report.wrench,
                    slip_work_j: report.friction_work_j,
                    converged: matches!(report.status, ContactStatus::NoContact | ContactStatus::Solved),
                }
            }
            Self::Corners(contact) => contact.evaluate(X_WS, ground, dt_s),
        }
    }

    /// Rate of the wrench with the pose at the last evaluation.
    pub fn tangent(&mut self) -> Mat6 {
        match self {
            Self::Elastic(contact) => contact.tangent(),
            Self::Corners(contact) => contact.tangent(),
        }
    }

    /// A number that stays while the tangent stays nearly true; a hard foot's is good for one pose only.
    pub fn tangent_label(&self) -> u64 {
        match self {
            Self::Elastic(contact) => contact.state_changes(),
            Self::Corners(contact) => contact.evaluations(),
        }
    }

    /// Fills in what the report holds beyond the wrench.
    pub fn complete(&mut self) {
        if let Self::Elastic(contact) = self {
            contact.complete();
        }
    }

    /// Accepts the last evaluation as history.
    pub fn commit(&mut self) {
        match self {
            Self::Elastic(contact) => contact.commit(),
            Self::Corners(contact) => contact.commit(),
        }
    }

    /// Contact starts anew at a pose in which the sole has stood for long: viscous stress has relaxed.
    pub fn place(&mut self, X_WS: &Transform, ground: &dyn Ground) -> ContactEvaluation {
        /// Long against any viscosity time (s).
        const FOR_EVER_S: f64 = 1e6;
        self.reset();
        let contact = self.evaluate(X_WS, ground, FOR_EVER_S);
        self.commit();
        contact
    }

    fn reset(&mut self) {
        match self {
            Self::Elastic(contact) => contact.reset(),
            Self::Corners(contact) => contact.reset(),
        }
    }

    /// Everything the elastic sole knows of its contact points, as last completed; a hard foot has no report.
    pub fn report(&self) -> Option<&ContactReport> {
        match self {
            Self::Elastic(contact) => Some(contact.report()),
            Self::Corners(_) => None,
        }
    }
}
