#include "host/recording/mat.hpp"

#include <gtest/gtest.h>
#include <matio.h>
#include <unistd.h>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

TEST(Mat, NamesAreValidInMatlab) {
  EXPECT_EQ(mat_name("∠ABC_smooth"), "x_ABC_smooth");
  EXPECT_EQ(mat_name("SensorA1"), "SensorA1");
  EXPECT_EQ(mat_name("3rd angle(deg)"), "x3rd_angle_deg_");
}

// MATLAB loads one of two variables of one name and says nothing.
TEST(Mat, ColumnsThatMatlabWouldCallTheSameAreBothKept) {
  const auto path =
      std::filesystem::path(testing::TempDir()) / ("flexor_same_" + std::to_string(::getpid()) + ".mat");
  Recording r;
  r.t_s = {0, 1};
  r.columns = {{"a(deg)", {1, 2}}, {"a deg ", {3, 4}}, {"t_s", {5, 6}}};
  write_mat(r, path, MatVersion::v5);
  mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  ASSERT_NE(file, nullptr);
  for (const auto& [name, first] :
       {std::pair{"t_s", 0.0}, {"a_deg_", 1.0}, {"a_deg__2", 3.0}, {"t_s_2", 5.0}}) {
    matvar_t* variable = Mat_VarRead(file, name);
    ASSERT_NE(variable, nullptr) << name;
    EXPECT_EQ(*static_cast<const double*>(variable->data), first) << name;
    Mat_VarFree(variable);
  }
  Mat_Close(file);
  std::filesystem::remove(path);
}

class MatFile : public testing::TestWithParam<MatVersion> {};

TEST_P(MatFile, ReadsBackWhatWasWritten) {
  const auto path =
      std::filesystem::path(testing::TempDir()) / ("flexor_" + std::to_string(::getpid()) + ".mat");
  Recording r;
  r.t_s = {0, 0.05, 0.1};
  r.columns = {{"∠ABC", {1.5, -2, 1e300}}};
  write_mat(r, path, GetParam());
  mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  ASSERT_NE(file, nullptr);
  for (const auto& [name, values] : {std::pair{"t_s", r.t_s}, std::pair{"x_ABC", r.columns[0].value}}) {
    matvar_t* variable = Mat_VarRead(file, name);
    ASSERT_NE(variable, nullptr) << name;
    ASSERT_EQ(variable->dims[0], 3u);
    EXPECT_EQ(variable->dims[1], 1u);
    const auto* data = static_cast<const double*>(variable->data);
    EXPECT_EQ(std::vector<double>(data, data + 3), values);
    Mat_VarFree(variable);
  }
  Mat_Close(file);
  std::filesystem::remove(path);
}

INSTANTIATE_TEST_SUITE_P(Versions, MatFile, testing::Values(MatVersion::v5, MatVersion::v7_3));

TEST(Mat, AnUnwritablePathLeavesNothing) {
  Recording r;
  r.t_s = {0, 1};
  EXPECT_THROW(write_mat(r, "/nonexistent/folder/x.mat", MatVersion::v5), io::InputError);
}

}  // namespace
}  // namespace flexor::recording
