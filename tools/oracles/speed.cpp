// Time per call of Pinocchio, header-only, on a model dumped by speed.py: the same measurement as
// crates/multibody/examples/speed.rs.
//
// g++ -std=c++17 -O3 -march=native -DNDEBUG -I... speed.cpp
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/centroidal.hpp>
#include <pinocchio/algorithm/compute-all-terms.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

using namespace pinocchio;

static SE3 pose(std::istream& in) {
  SE3 X;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) in >> X.rotation()(i, j);
  for (int i = 0; i < 3; ++i) in >> X.translation()[i];
  return X;
}

static Model load(std::istream& in) {
  Model model;
  int joints = 0, frames = 0;
  in >> joints;
  for (int k = 0; k < joints; ++k) {
    std::string kind;
    JointIndex parent;
    Eigen::Vector3d axis;
    in >> kind >> parent >> axis[0] >> axis[1] >> axis[2];
    const SE3 X = pose(in);
    double mass;
    Eigen::Vector3d com;
    Eigen::Matrix3d about_com;
    in >> mass >> com[0] >> com[1] >> com[2];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) in >> about_com(i, j);
    const std::string name = "j" + std::to_string(k);
    JointIndex id = 0;
    if (kind == "JointModelFreeFlyer") id = model.addJoint(parent, JointModelFreeFlyer(), X, name);
    else if (kind == "JointModelRX") id = model.addJoint(parent, JointModelRX(), X, name);
    else if (kind == "JointModelRY") id = model.addJoint(parent, JointModelRY(), X, name);
    else if (kind == "JointModelRZ") id = model.addJoint(parent, JointModelRZ(), X, name);
    else if (kind == "JointModelPX") id = model.addJoint(parent, JointModelPX(), X, name);
    else if (kind == "JointModelPY") id = model.addJoint(parent, JointModelPY(), X, name);
    else if (kind == "JointModelPZ") id = model.addJoint(parent, JointModelPZ(), X, name);
    else if (kind == "JointModelRUBX") id = model.addJoint(parent, JointModelRUBX(), X, name);
    else if (kind == "JointModelRUBY") id = model.addJoint(parent, JointModelRUBY(), X, name);
    else if (kind == "JointModelRUBZ") id = model.addJoint(parent, JointModelRUBZ(), X, name);
    else if (kind == "JointModelRevoluteUnaligned") id = model.addJoint(parent, JointModelRevoluteUnaligned(axis), X, name);
    else if (kind == "JointModelPrismaticUnaligned") id = model.addJoint(parent, JointModelPrismaticUnaligned(axis), X, name);
    else { std::cerr << "unknown joint " << kind << "\n"; exit(2); }
    model.appendBodyToJoint(id, Inertia(mass, com, about_com), SE3::Identity());
  }
  in >> frames;
  for (int k = 0; k < frames; ++k) {
    JointIndex parent;
    in >> parent;
    model.addFrame(Frame("f" + std::to_string(k), parent, 0, pose(in), OP_FRAME));
  }
  return model;
}

int main(int, char** argv) {
  std::ifstream in(argv[1]);
  Model model = load(in);
  Data data(model);
  const FrameIndex first = model.frames.size() - std::stoul(argv[2]);
  constexpr int STATES = 64, BATCHES = 200;
  srand(1);
  std::vector<Eigen::VectorXd> q, v, a, tau;
  for (int k = 0; k < STATES; ++k) {
    q.push_back(integrate(model, neutral(model), Eigen::VectorXd::Random(model.nv) * 3));
    v.push_back(Eigen::VectorXd::Random(model.nv));
    a.push_back(Eigen::VectorXd::Random(model.nv));
    tau.push_back(Eigen::VectorXd::Random(model.nv) * 10);
  }
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model.nv);
  Data::Matrix6x J = Data::Matrix6x::Zero(6, model.nv);
  double sink = 0;
  std::printf("{\"nv\": %d", model.nv);
  auto time = [&](const char* name, auto&& call) {
    double fastest = 1e9;
    for (int b = 0; b < BATCHES; ++b) {
      const auto start = std::chrono::steady_clock::now();
      for (int k = 0; k < STATES; ++k) call(k);
      const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / STATES;
      if (s < fastest) fastest = s;
    }
    std::printf(", \"%s\": %.1f", name, fastest * 1e9);
  };
  time("forward kinematics", [&](int k) { forwardKinematics(model, data, q[k]); });
  time("RNEA", [&](int k) { rnea(model, data, q[k], v[k], a[k]); });
  time("bias forces", [&](int k) { nonLinearEffects(model, data, q[k], v[k]); });
  // The quicker of Pinocchio's two conventions is the yardstick.
  time("CRBA (local)", [&](int k) { crba(model, data, q[k], Convention::LOCAL); });
  time("CRBA (world)", [&](int k) { crba(model, data, q[k], Convention::WORLD); });
  time("ABA (local)", [&](int k) { aba(model, data, q[k], v[k], tau[k], Convention::LOCAL); });
  time("ABA (world)", [&](int k) { aba(model, data, q[k], v[k], tau[k], Convention::WORLD); });
  time("Jacobians of the frames", [&](int k) {
    computeJointJacobians(model, data, q[k]);
    for (FrameIndex f = first; f < model.frames.size(); ++f) {
      J.setZero();
      updateFramePlacement(model, data, f);
      getFrameJacobian(model, data, f, LOCAL_WORLD_ALIGNED, J);
      sink += J(0, 0);
    }
  });
  std::vector<Data::Matrix6x> Js(model.frames.size() - first, J);
  time("whole-body terms", [&](int k) {
    computeAllTerms(model, data, q[k], v[k]);
    forwardKinematics(model, data, q[k], v[k], zero);
    updateFramePlacements(model, data);
    centerOfMass(model, data, ACCELERATION, false);
    for (FrameIndex f = first; f < model.frames.size(); ++f) {
      Data::Matrix6x& Jf = Js[f - first];
      Jf.setZero();
      getFrameJacobian(model, data, f, LOCAL_WORLD_ALIGNED, Jf);
      sink += Jf(0, 0) + getFrameClassicalAcceleration(model, data, f, LOCAL_WORLD_ALIGNED).linear()[0];
    }
  });
  std::printf(", \"sink\": %d}\n", sink > 1e300);
}
