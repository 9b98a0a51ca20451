// Of symmetric matrices. In a file of their own: the templates of Eigen's solver take the compiler longer
// than all that a test writes itself.
#pragma once

#include <Eigen/Core>

namespace duet::test {

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);    // the least one first
Eigen::MatrixXd positive_part(const Eigen::MatrixXd& symmetric);  // without what has eigenvalues below zero

}  // namespace duet::test
