//! A simplex in integers, which starts at a vertex that floating point took for the best.

use coloc_bounds::Program;
use num_bigint::{BigInt, Sign};
use num_rational::BigRational;

/// A sparse row times a power of two, so that all of it is integers: `a · z ≤ rhs`.
#[derive(Clone)]
struct Row {
    terms: Vec<(usize, BigInt)>,
    rhs: BigInt,
}

/// `numerators / denominator`, and the denominator is positive.
struct Solution {
    numerators: Vec<BigInt>,
    denominator: BigInt,
}

pub(crate) struct Exact {
    rows: Vec<Row>,
    columns: usize,
    /// The objective, times a positive number.
    objective: Vec<BigInt>,
    unscaled: Vec<(usize, BigRational)>,
    working: Vec<usize>,
}

/// Mantissa and exponent: the value is `mantissa · 2^exponent`.
fn decode(value: f64) -> (i64, i32) {
    let bits = value.to_bits();
    let exponent = i32::try_from((bits >> 52) & 0x7ff).unwrap();
    let fraction = i64::try_from(bits & ((1 << 52) - 1)).unwrap();
    let mantissa = if exponent == 0 {
        fraction << 1
    } else {
        fraction | (1 << 52)
    };
    let signed = if value.is_sign_negative() {
        -mantissa
    } else {
        mantissa
    };
    (signed, exponent - 1075)
}

fn integers(values: &[f64]) -> Vec<BigInt> {
    let decoded: Vec<_> = values.iter().map(|&it| decode(it)).collect();
    let used = decoded.iter().filter(|it| it.0 != 0);
    let lowest = used.map(|it| it.1).min().unwrap_or(0);
    let scaled = decoded.into_iter().map(|(mantissa, exponent)| {
        let shift = usize::try_from(exponent.max(lowest) - lowest).unwrap();
        BigInt::from(mantissa) << shift
    });
    scaled.collect()
}

fn row(terms: &[(usize, f64)], rhs: f64) -> Row {
    let mut values: Vec<f64> = terms.iter().map(|it| it.1).collect();
    values.push(rhs);
    let mut integers = integers(&values);
    let rhs = integers.pop().unwrap();
    let columns = terms.iter().map(|it| it.0);
    Row {
        terms: columns.zip(integers).collect(),
        rhs,
    }
}

impl Exact {
    /// `working` in the simplex's own numbers: rows, lower bounds, upper bounds.
    pub(crate) fn new(program: &Program, objective: &[(usize, f64)], working: &[usize]) -> Self {
        let columns = program.columns();
        let mut rows: Vec<Row> = (0..program.rows())
            .map(|it| row(program.terms(it), program.rhs(it)))
            .collect();
        rows.extend((0..columns).map(|it| row(&[(it, -1.0)], -program.bounds(it).0)));
        rows.extend((0..columns).map(|it| row(&[(it, 1.0)], program.bounds(it).1)));
        let mut dense = vec![0.0; columns];
        for &(column, factor) in objective {
            dense[column] = factor;
        }
        assert_eq!(working.len(), columns);
        Self {
            rows,
            columns,
            objective: integers(&dense),
            unscaled: objective
                .iter()
                .map(|&(column, factor)| (column, BigRational::from_float(factor).unwrap()))
                .collect(),
            working: working.to_vec(),
        }
    }

    /// Steps until the vertex is exactly the best; how many were needed.
    pub(crate) fn improve(&mut self, name: &str) -> usize {
        for steps in 0..50 {
            let z = self.vertex();
            let y = self.multipliers();
            let broken = self.broken(&z);
            let negative = (0..self.columns)
                .filter(|&q| y.numerators[q].sign() == Sign::Minus)
                .min_by_key(|&q| self.working[q]);
            match (broken, negative) {
                (None, None) => return steps,
                (None, Some(q)) => self.primal_step(q, &z),
                (Some(row), None) => self.dual_step(row, &y),
                (Some(_), Some(_)) => panic!("{name}: a vertex that is neither of the two"),
            }
        }
        panic!("{name}: no end");
    }

    pub(crate) fn value(&self) -> BigRational {
        let z = self.vertex();
        let terms = self.unscaled.iter();
        terms
            .map(|(column, factor)| {
                factor * BigRational::new(z.numerators[*column].clone(), z.denominator.clone())
            })
            .sum()
    }

    fn vertex(&self) -> Solution {
        let lines = self.working.iter().map(|&it| {
            let mut line = self.dense(it);
            line.push(self.rows[it].rhs.clone());
            line
        });
        solve(lines.collect())
    }

    /// `A_Wᵀ y = c`, for the rows as they are scaled: signs are what counts.
    fn multipliers(&self) -> Solution {
        let mut lines = self.transposed();
        for (line, factor) in lines.iter_mut().zip(&self.objective) {
            line.push(factor.clone());
        }
        solve(lines)
    }

    fn transposed(&self) -> Vec<Vec<BigInt>> {
        let mut lines = vec![vec![BigInt::ZERO; self.columns]; self.columns];
        for (q, &row) in self.working.iter().enumerate() {
            for (column, factor) in &self.rows[row].terms {
                lines[*column][q].clone_from(factor);
            }
        }
        lines
    }

    fn dense(&self, row: usize) -> Vec<BigInt> {
        let mut line = vec![BigInt::ZERO; self.columns];
        for (column, factor) in &self.rows[row].terms {
            line[*column].clone_from(factor);
        }
        line
    }

    fn dot(&self, row: usize, vector: &[BigInt]) -> BigInt {
        let terms = self.rows[row].terms.iter();
        terms
            .map(|(column, factor)| factor * &vector[*column])
            .sum()
    }

    /// The first row that is not satisfied.
    fn broken(&self, z: &Solution) -> Option<usize> {
        (0..self.rows.len())
            .filter(|it| !self.working.contains(it))
            .find(|&it| self.dot(it, &z.numerators) > &self.rows[it].rhs * &z.denominator)
    }

    fn primal_step(&mut self, q: usize, z: &Solution) {
        let mut lines: Vec<_> = self.working.iter().map(|&it| self.dense(it)).collect();
        for (place, line) in lines.iter_mut().enumerate() {
            line.push(BigInt::from(if place == q { -1 } else { 0 }));
        }
        let step = solve(lines);
        let mut best: Option<(usize, BigRational)> = None;
        for row in (0..self.rows.len()).filter(|it| !self.working.contains(it)) {
            let towards = self.dot(row, &step.numerators);
            if towards.sign() != Sign::Plus {
                continue;
            }
            let slack = &self.rows[row].rhs * &z.denominator - self.dot(row, &z.numerators);
            let length = BigRational::new(slack, towards);
            if best.as_ref().is_none_or(|it| length < it.1) {
                best = Some((row, length));
            }
        }
        self.working[q] = best.expect("the box ends every edge").0;
    }

    fn dual_step(&mut self, row: usize, y: &Solution) {
        let mut lines = self.transposed();
        for (line, factor) in lines.iter_mut().zip(self.dense(row)) {
            line.push(factor);
        }
        let sum = solve(lines);
        let mut best: Option<(usize, BigRational)> = None;
        for q in 0..self.columns {
            if sum.numerators[q].sign() == Sign::Plus {
                let ratio = BigRational::new(y.numerators[q].clone(), sum.numerators[q].clone());
                if best.as_ref().is_none_or(|it| ratio < it.1) {
                    best = Some((q, ratio));
                }
            }
        }
        self.working[best.expect("the program is feasible").0] = row;
    }
}

/// Gauss and Jordan without fractions (Bareiss): each line has its right-hand side at its end.
fn solve(mut lines: Vec<Vec<BigInt>>) -> Solution {
    let size = lines.len();
    let mut last = BigInt::from(1);
    for k in 0..size {
        let pivot = (k..size).find(|&it| lines[it][k].sign() != Sign::NoSign);
        lines.swap(k, pivot.expect("the rows of a vertex are independent"));
        let top = lines[k].clone();
        for (i, line) in lines.iter_mut().enumerate() {
            if i == k {
                continue;
            }
            let factor = line[k].clone();
            for (j, entry) in line.iter_mut().enumerate().skip(k) {
                *entry = (&top[k] * &*entry - &factor * &top[j]) / &last;
            }
            // Left of the pivot only the diagonal is not zero.
            if i < k {
                line[i].clone_from(&top[k]);
            }
        }
        last.clone_from(&top[k]);
    }
    let negative = last.sign() == Sign::Minus;
    let numerators = lines.into_iter().map(|mut line| {
        let value = line.pop().unwrap_or_default();
        if negative { -value } else { value }
    });
    Solution {
        numerators: numerators.collect(),
        denominator: if negative { -last } else { last },
    }
}
