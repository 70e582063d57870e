#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

// Eigenvalues of symmetric 2 x 2 matrices, compiled once (relative_pose.cpp): each file with a
// solver of its own compiles for five seconds more.
extern template Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>&
Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>::compute(const Eigen::EigenBase<Eigen::Matrix2d>&,
                                                        int options);
