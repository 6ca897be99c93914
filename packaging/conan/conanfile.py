"""The flight library as a Conan package: conan create packaging/conan. The program needs libraries that come with a distribution; see
docs/install.md."""
import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load
from conan.tools.system.package_manager import Apt, Dnf


class TrihedronCore(ConanFile):
    name = "trihedron-core"
    description = "In-flight calibration of electrostatic gyros against a star tracker: the flight library"
    topics = ("aerospace", "attitude", "calibration", "gyro", "star-tracker")
    license = "Apache-2.0"
    package_type = "static-library"
    settings = "os", "arch", "compiler", "build_type"
    options = {
        # Of the machine, /usr/include/eigen3, instead of the package eigen.
        "system_eigen": [True, False],
        # On-board objects that are built; a flight computer needs one: of pair, trio, full and paper, with commas.
        "on_board": ["ANY"],
    }
    default_options = {"system_eigen": False, "on_board": "pair,trio,full,paper"}

    def set_version(self):
        text = load(self, os.path.join(self.recipe_folder, "..", "..", "CMakeLists.txt"))
        self.version = re.search(r"project\(trihedron VERSION ([0-9.]+)", text)[1]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "core/CMakeLists.txt", "core/include/*", "core/src/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        if not self.options.system_eigen:
            # Its headers are included by ours.
            self.requires("eigen/[>=3.4.0 <4]", transitive_headers=True)

    def system_requirements(self):
        if self.options.system_eigen:
            Apt(self).install(["libeigen3-dev"])
            Dnf(self).install(["eigen3-devel"])

    def validate(self):
        check_min_cppstd(self, 20)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["TRIHEDRON_ONLY_CORE"] = True
        toolchain.cache_variables["TRIHEDRON_ON_BOARD"] = str(self.options.on_board).replace(",", ";")
        toolchain.cache_variables["CMAKE_UNITY_BUILD"] = True
        toolchain.cache_variables["CMAKE_UNITY_BUILD_BATCH_SIZE"] = "12"
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()

    def package_info(self):
        # For CMake, the package that the library itself installs, as without Conan; for other build systems what follows.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "trihedron")]
        self.cpp_info.libs = ["trihedron_core"]
        self.cpp_info.defines = ["EIGEN_DONT_VECTORIZE"]
        if self.options.system_eigen:
            self.cpp_info.includedirs.append("/usr/include/eigen3")
