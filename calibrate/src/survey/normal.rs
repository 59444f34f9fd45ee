//! The normal equations of a path with what was seen from it: a chain of nodes, each tied to the next one, and landmarks that any of them
//! may see. Nodes are eliminated one after another, so that the time grows with the length of the path alone; what remains is a small
//! system of the landmarks, whose inverse is their covariance whatever the path was.

use nalgebra::{SMatrix, SVector};

use crate::symmetric::Cholesky;

/// Numbers of a node: x, y, heading; the slow errors of range and bearing; those of a fix.
pub(super) const NODE: usize = 7;

/// Numbers of a landmark: x, y; of the sensor: its errors of range and bearing that stay for the whole drive.
pub(super) const PLACE: usize = 2;

pub(super) type Place = SVector<f64, PLACE>;
pub(super) type PlaceBlock = SMatrix<f64, PLACE, PLACE>;
pub(super) type Node = SVector<f64, NODE>;
pub(super) type Block = SMatrix<f64, NODE, NODE>;
/// Between a node and a landmark.
pub(super) type Sight = SMatrix<f64, NODE, PLACE>;

/// `H δ = right`, by blocks.
pub(super) struct System {
    pub(super) diagonal: Vec<Block>,
    /// Between a node and the next one.
    pub(super) next: Vec<Block>,
    pub(super) right: Vec<Node>,
    /// By node: which landmark it sees, and how.
    pub(super) sights: Vec<Vec<(usize, Sight)>>,
    /// The last one is the sensor.
    pub(super) landmarks: Vec<PlaceBlock>,
    /// Between each landmark and the sensor.
    pub(super) ties: Vec<PlaceBlock>,
    pub(super) landmarks_right: Vec<Place>,
}

/// The step, and how well the landmarks are known.
pub(super) struct Solution {
    pub(super) nodes: Vec<Node>,
    pub(super) landmarks: Vec<Place>,
    pub(super) covariances: Vec<PlaceBlock>,
}

/// A node that was eliminated: in terms of the landmarks and of the next one.
struct Gone {
    /// For each number of the landmarks, then the right side.
    columns: Vec<Node>,
    next: Block,
}

impl System {
    pub(super) fn new(nodes: usize, landmarks: usize) -> Self {
        let ties = vec![PlaceBlock::zeros(); landmarks];
        let landmarks = landmarks + 1;
        Self {
            ties,
            diagonal: vec![Block::zeros(); nodes],
            next: vec![Block::zeros(); nodes],
            right: vec![Node::zeros(); nodes],
            sights: vec![Vec::new(); nodes],
            landmarks: vec![PlaceBlock::zeros(); landmarks],
            landmarks_right: vec![Place::zeros(); landmarks],
        }
    }

    /// Nothing where it is not positive definite.
    pub(super) fn solve(mut self) -> Option<Solution> {
        let mut rest = Rest::of(&self);
        let mut gone = Vec::with_capacity(self.diagonal.len());
        let mut carried = vec![Node::zeros(); rest.size + 1];
        for at in 0..self.diagonal.len() {
            let mut border = carried;
            for (landmark, sight) in &self.sights[at] {
                for (column, own) in sight.column_iter().enumerate() {
                    border[PLACE * landmark + column] += own;
                }
            }
            border[rest.size] += self.right[at];
            let root = self.diagonal[at].cholesky()?;
            let columns: Vec<Node> = border.iter().map(|it| root.solve(it)).collect();
            rest.less(&border, &columns);
            let (tie, next) = (self.next[at], root.solve(&self.next[at]));
            if let Some(following) = self.diagonal.get_mut(at + 1) {
                *following -= tie.tr_mul(&next);
            }
            carried = columns.iter().map(|it| -tie.tr_mul(it)).collect();
            gone.push(Gone { columns, next });
        }
        rest.solve(&gone)
    }
}

/// What is left of the landmarks' own equations.
struct Rest {
    size: usize,
    /// Row-major.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Rest {
    fn of(system: &System) -> Self {
        let size = PLACE * system.landmarks.len();
        let mut matrix = vec![0.0; size * size];
        for (landmark, block) in system.landmarks.iter().enumerate() {
            for (row, column) in of_block() {
                let begin = PLACE * landmark;
                matrix[(begin + row) * size + begin + column] = block[(row, column)];
            }
        }
        let sensor = PLACE * system.ties.len();
        for (landmark, block) in system.ties.iter().enumerate() {
            for (row, column) in of_block() {
                let (row_of, column_of) = (PLACE * landmark + row, sensor + column);
                matrix[row_of * size + column_of] = block[(row, column)];
                matrix[column_of * size + row_of] = block[(row, column)];
            }
        }
        let right = system.landmarks_right.iter();
        Self {
            size,
            matrix,
            right: right.flat_map(|it| it.iter().copied()).collect(),
        }
    }

    fn less(&mut self, border: &[Node], columns: &[Node]) {
        for (row, own) in border.iter().take(self.size).enumerate() {
            for (column, other) in columns.iter().take(self.size).enumerate() {
                self.matrix[row * self.size + column] -= own.dot(other);
            }
            self.right[row] -= own.dot(&columns[self.size]);
        }
    }

    fn solve(&self, gone: &[Gone]) -> Option<Solution> {
        let root = Cholesky::new(&self.matrix, self.size)?;
        let (landmarks, inverse) = (root.solve(&self.right), root.inverse());
        let mut nodes = vec![Node::zeros(); gone.len()];
        let mut following = Node::zeros();
        for (node, gone) in nodes.iter_mut().zip(gone).rev() {
            *node = gone.columns[self.size] - gone.next * following;
            for (column, step) in gone.columns.iter().zip(&landmarks) {
                *node -= column * *step;
            }
            following = *node;
        }
        let block = |landmark: usize| {
            let begin = PLACE * landmark;
            PlaceBlock::from_fn(|row, column| inverse[(begin + row) * self.size + begin + column])
        };
        Some(Solution {
            nodes,
            covariances: (0..self.size / PLACE).map(block).collect(),
            landmarks: landmarks
                .chunks_exact(PLACE)
                .map(Place::from_column_slice)
                .collect(),
        })
    }
}

/// Rows and columns of a landmark's own block.
fn of_block() -> impl Iterator<Item = (usize, usize)> {
    (0..PLACE).flat_map(|row| (0..PLACE).map(move |column| (row, column)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes, two landmarks and the sensor, all tied.
    fn system() -> System {
        let mut system = System::new(3, 2);
        let number =
            |a: usize, b: usize| f64::from(u32::try_from(7 * a + 3 * b).unwrap() % 11) / 11.0;
        for node in 0..3 {
            system.diagonal[node] = Block::from_diagonal_element(9.0 + number(node, 1));
            system.right[node] = Node::from_fn(|row, _| number(node, row));
            if node < 2 {
                system.next[node] = Block::from_fn(|row, column| 0.3 * number(row + node, column));
            }
            for landmark in 0..3 {
                let sight =
                    Sight::from_fn(|row, column| 0.2 * number(row, column + landmark + node));
                system.sights[node].push((landmark, sight));
            }
        }
        let own = PlaceBlock::from_diagonal_element(5.0) + PlaceBlock::from_element(0.3);
        system.landmarks = vec![own; 3];
        system.ties = vec![PlaceBlock::new(0.1, -0.2, 0.3, 0.4); 2];
        system.landmarks_right = [1.0, -2.0, 0.5]
            .map(|it| Place::from_fn(|row, _| it + number(row, 2)))
            .to_vec();
        system
    }

    /// The same, written out.
    fn whole(system: &System) -> (Vec<f64>, Vec<f64>) {
        let size = 3 * NODE + 3 * PLACE;
        let mut matrix = vec![0.0; size * size];
        let mut set = |row: usize, column: usize, value: f64| {
            matrix[row * size + column] = value;
            matrix[column * size + row] = value;
        };
        for node in 0..3 {
            for (row, column) in (0..NODE).flat_map(|row| (0..NODE).map(move |it| (row, it))) {
                set(
                    NODE * node + row,
                    NODE * node + column,
                    system.diagonal[node][(row, column)],
                );
                if node < 2 {
                    let tie = system.next[node][(row, column)];
                    set(NODE * node + row, NODE * (node + 1) + column, tie);
                }
            }
            for (landmark, sight) in &system.sights[node] {
                for (row, column) in (0..NODE).flat_map(|row| (0..PLACE).map(move |it| (row, it))) {
                    let column_of = 3 * NODE + PLACE * landmark + column;
                    set(NODE * node + row, column_of, sight[(row, column)]);
                }
            }
        }
        for landmark in 0..3 {
            let block = system.landmarks[landmark];
            for (row, column) in of_block() {
                let begin = 3 * NODE + PLACE * landmark;
                set(begin + row, begin + column, block[(row, column)]);
            }
        }
        for (landmark, block) in system.ties.iter().enumerate() {
            for (row, column) in of_block() {
                let begin = 3 * NODE + PLACE * landmark;
                set(
                    begin + row,
                    3 * NODE + 2 * PLACE + column,
                    block[(row, column)],
                );
            }
        }
        let nodes = system.right.iter().flat_map(|it| it.iter().copied());
        let landmarks = system
            .landmarks_right
            .iter()
            .flat_map(|it| it.iter().copied());
        (matrix, nodes.chain(landmarks).collect())
    }

    #[test]
    fn elimination_gives_what_the_whole_matrix_gives() {
        let (matrix, right) = whole(&system());
        let size = right.len();
        let root = Cholesky::new(&matrix, size).unwrap();
        let (expected, inverse) = (root.solve(&right), root.inverse());
        let found = system().solve().unwrap();
        let nodes = found.nodes.iter().flat_map(|it| it.iter().copied());
        let landmarks = found.landmarks.iter().flat_map(|it| it.iter().copied());
        for (found, expected) in nodes.chain(landmarks).zip(&expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        for (landmark, block) in found.covariances.iter().enumerate() {
            let begin = 3 * NODE + PLACE * landmark;
            for (row, column) in of_block() {
                let expected = inverse[(begin + row) * size + begin + column];
                assert!((block[(row, column)] - expected).abs() < 1e-12);
            }
        }
    }
}
