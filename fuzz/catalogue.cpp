#include "trihedron/io/catalogue.hpp"

#include "fixtures.hpp"
#include "target.hpp"

void trihedron::fuzz::read_catalogue(std::string_view bytes) {
  const DirectoryFile file(bytes);
  const CatalogueEntry entry{"Resurs-DK1", "another", "2009-05-21", 1, io::sample_calibration()};
  std::size_t before = 0;
  try {
    before = io::read_catalogue(file.path()).size();
  } catch (const io::InputRefused&) {
  }
  expect(std::distance(std::filesystem::directory_iterator(file.directory()), {}) == 1,
         "nothing left beside the catalogue");
  io::expect_catalogue_of("Resurs-DK1", file.path());
  io::add_to_catalogue(file.path(), {&entry, 1});
  expect(io::read_catalogue(file.path()).size() >= before, "what was there before");
}
