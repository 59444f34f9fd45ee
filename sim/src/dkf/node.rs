//! What one robot keeps and does \[B3, B4, B6\]: `x̂`, P, and of each other robot a factor, `P_lm = A_lm A_mlᵀ`.

use coloc_estimator::angle::wrap;

use super::{Matrix, solve_lower, symmetric};

/// One robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// `x̂`
    pub state: Vec<f64>,
    /// P
    pub covariance: Matrix,
    /// `A_lm` for each robot m; its own place is empty.
    pub factors: Vec<Matrix>,
}

/// First round: what those that measure or are measured tell one another.
#[derive(Clone, Debug)]
pub struct Offer {
    /// `x̂`
    pub state: Vec<f64>,
    /// P
    pub covariance: Matrix,
    /// Its factors with each of the others of them.
    pub factors: Vec<Matrix>,
}

impl Offer {
    /// Numbers in it; of P a triangle.
    #[must_use]
    pub fn numbers(&self) -> usize {
        let n = self.state.len();
        n + triangle(n) + numbers(&self.factors)
    }
}

/// Second round: what every other robot of the cluster needs for its own gain.
#[derive(Clone, Debug)]
pub struct Update {
    /// L of `S = L Lᵀ`.
    pub root: Matrix,
    /// `L⁻¹ r`
    pub whitened: Matrix,
    /// Of each robot that measures or is measured: H, and its factor with the one that this is sent to.
    pub parts: Vec<(usize, Matrix, Matrix)>,
}

impl Update {
    /// Numbers in it; of L a triangle.
    #[must_use]
    pub fn numbers(&self) -> usize {
        let parts = self.parts.iter();
        let blocks: usize = parts.map(|(_, h, a)| h.len() + a.len()).sum();
        triangle(self.root.nrows()) + self.whitened.len() + blocks
    }
}

/// Third round: what the two of a pair bring together.
#[derive(Clone, Debug)]
pub struct Factor {
    /// Factor with the other one.
    pub factor: Matrix,
    /// `G = K L`
    pub gain: Matrix,
}

impl Factor {
    /// Numbers in it.
    #[must_use]
    pub fn numbers(&self) -> usize {
        self.factor.len() + self.gain.len()
    }
}

/// How a cross-covariance is split in two \[B8\].
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Split {
    /// `A_lm = X`, `A_ml = I`.
    Trivial,
    /// The other way round: any split that is exact gives the same.
    Mirrored,
}

impl Split {
    /// The factors of X of the robot with the lower number, and of the other.
    #[must_use]
    pub fn of(self, x: Matrix) -> (Matrix, Matrix) {
        let one = Matrix::identity(x.nrows(), x.nrows());
        match self {
            Self::Trivial => (x, one),
            Self::Mirrored => (one, x.transpose()),
        }
    }
}

/// Numbers of a symmetric matrix.
#[must_use]
pub(super) fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Robots that never met.
pub(super) fn is_zero(factor: &Matrix) -> bool {
    factor.iter().all(|entry| *entry == 0.0)
}

fn numbers(all: &[Matrix]) -> usize {
    all.iter().map(Matrix::len).sum()
}

impl Node {
    /// A robot of a team of `robots` that has never met another.
    #[must_use]
    pub fn new(state: Vec<f64>, covariance: Matrix, robots: usize) -> Self {
        let size = state.len();
        Self {
            state,
            covariance,
            factors: vec![Matrix::zeros(size, size); robots],
        }
    }

    /// Moves on: `P ← Φ P Φᵀ + Q`, `A ← Φ A`. Nobody is told.
    pub fn propagate(&mut self, state: Vec<f64>, phi: &Matrix, noise: &Matrix) {
        self.state = state;
        self.covariance = symmetric(&(phi * &self.covariance * phi.transpose() + noise));
        for factor in self.factors.iter_mut().filter(|it| !is_zero(it)) {
            *factor = phi * &*factor;
        }
    }

    /// What is told in the first round, to all of `others`.
    #[must_use]
    pub fn offer(&self, others: &[usize]) -> Offer {
        Offer {
            state: self.state.clone(),
            covariance: self.covariance.clone(),
            factors: others.iter().map(|&it| self.factors[it].clone()).collect(),
        }
    }

    /// `G = K L = (Σ P_la H_aᵀ) L⁻ᵀ` of robot `me`.
    #[must_use]
    pub fn gain(&self, me: usize, update: &Update) -> Matrix {
        let mut seen = Matrix::zeros(self.state.len(), update.root.nrows());
        for (robot, h, factor) in &update.parts {
            let block = if *robot == me {
                self.covariance.clone()
            } else {
                &self.factors[*robot] * factor.transpose()
            };
            seen += block * h.transpose();
        }
        solve_lower(&update.root, &seen.transpose()).transpose()
    }

    /// `x̂ += G L⁻¹ r`, `P −= G Gᵀ`; the third number of a pose is an angle.
    pub fn correct(&mut self, gain: &Matrix, whitened: &Matrix) {
        let step = gain * whitened;
        for (value, step) in self.state.iter_mut().zip(&step) {
            *value += step;
        }
        if let [_, _, phi] = &mut self.state[..] {
            *phi = wrap(*phi);
        }
        self.covariance = symmetric(&(&self.covariance - gain * gain.transpose()));
    }

    /// What is told in the third round.
    #[must_use]
    pub fn factor(&self, other: usize, gain: &Matrix) -> Factor {
        Factor {
            factor: self.factors[other].clone(),
            gain: gain.clone(),
        }
    }
}
