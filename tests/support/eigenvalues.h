// Eigenvalues of symmetric matrices. They have a source file of their own, because the templates of Eigen's
// solver take the compiler longer than a whole test.
#pragma once

#include <Eigen/Core>

namespace duet::test {

// Returns the eigenvalues in ascending order.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);
// Returns the matrix with its negative eigenvalues replaced by zero.
Eigen::MatrixXd positive_part(const Eigen::MatrixXd& symmetric);

}  // namespace duet::test
